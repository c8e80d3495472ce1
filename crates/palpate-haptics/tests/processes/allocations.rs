//! A cycle allocates nothing.

use super::scenes::{STEP_S, half_width, model, path, process};
use palpate_haptics::SceneNames;
use palpate_haptics::device::{DeviceSpec, Hand, Mount, SimulatedDevice};
use palpate_haptics::log::LogWriter;
use palpate_haptics::{
    Cycle, HapticUpdate, PassivityController, Safety, SafetyLimits, Snapshot, Timing, snapshot_buffer,
};
use palpate_testkit::{CountingAllocator, allocations};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::time::Duration;

#[global_allocator]
static COUNTING: CountingAllocator = CountingAllocator;

/// Force of a device that presses [N], at least.
const PRESSES_N: f64 = 0.01;

#[test]
fn the_cycles_of_force_process_and_haptic_update_make_no_allocation() {
    let model = model(2, 300.0);
    let edge = half_width(&model) + 0.004;
    let (mut force, ports) = process(&model);
    let mut updates: Vec<HapticUpdate> = ports
        .into_iter()
        .zip([1.0, -1.0])
        .map(|(port, side)| {
            let wanted = path(&format!("0,{},0,0\n0.5,{},0,0\n", side * 1.2 * edge, side * 0.9 * edge));
            let device = SimulatedDevice::new(DeviceSpec::TOUCH, Hand::FIRM, wanted);
            let passivity = PassivityController::new(0.2, 55e-6, STEP_S);
            let safety = Safety::new(SafetyLimits::default());
            HapticUpdate::new(Box::new(device), port, Mount::default(), safety, Some(passivity), false)
        })
        .collect();
    let (mut snapshot_writer, _snapshots) =
        snapshot_buffer(&Snapshot::new(&model, force.state(), force.input()));
    let names = SceneNames {
        objects: vec!["body".into()],
        devices: vec!["a".into(), "b".into()],
        obstacles: vec!["floor".into()],
        ..SceneNames::default()
    };
    let start = (&*model, force.state(), force.input());
    let (mut sender, _writer) =
        LogWriter::new(Cursor::new(Vec::new()), names, BTreeMap::new(), &[], start).expect("a log in memory");
    let mut timing = Timing::default();
    force.warm_up();

    let (before, mut pushed) = (allocations(), 0.0_f64);
    for tick in 1..=1500_u64 {
        let now_s = tick as f64 * STEP_S;
        updates.iter_mut().for_each(|update| update.cycle(now_s));
        force.cycle(now_s);
        if tick % 16 == 0 {
            snapshot_writer.publish(tick, force.input(), force.state());
            sender.record_frame(|frame| frame.capture(force.input(), force.state()));
        }
        sender.record_step(|record| record.capture(force.input(), force.state()));
        let late = Duration::from_nanos(tick);
        timing.record(Cycle { lateness: late, compute: 2 * late, overrun: None });
        pushed = pushed.max(force.state().output().devices[0].force_on_hand.length());
    }
    assert_eq!(allocations() - before, 0, "allocations in 1500 cycles");
    assert!(pushed > PRESSES_N && sender.missed() == 0, "{pushed} N");
    let probe = Box::new(0_u64);
    assert!(allocations() > before, "{probe}");
}
