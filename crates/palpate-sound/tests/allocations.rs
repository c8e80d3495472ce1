//! Capture on the force process, and synthesis once its buffers have grown: neither allocates.

use palpate::{Input, Model, ModelParameters, State, step};
use palpate_sound::{SoundParameters, StepRecord, Synthesiser};
use palpate_testkit::{CountingAllocator, allocations, free_block, object_at};

#[global_allocator]
static COUNTING: CountingAllocator = CountingAllocator;

#[test]
fn steps_are_captured_and_synthesised_without_allocation() {
    let body = object_at(&free_block(), palpate::glam::DVec3::ZERO, palpate::glam::DVec3::X);
    let model = Model::new(ModelParameters::for_reference(), vec![body]).expect("a good model");
    let mut state = State::new(&model);
    let mut synthesiser = Synthesiser::new(&model, &state, &SoundParameters::default());
    let mut record = StepRecord::new(&synthesiser);
    let mut samples = Vec::new();
    let mut run = |steps: usize| {
        for _ in 0..steps {
            step(&model, &mut state, &Input::default());
            record.capture(&state);
            samples.clear();
            synthesiser.synthesise(&record, &mut samples);
        }
    };
    run(10);
    let before = allocations();
    run(100);
    assert_eq!(allocations() - before, 0);
}
