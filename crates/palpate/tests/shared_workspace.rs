//! States that share the buffers of a step go on, to the bit, as with buffers of their own.

use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Input, Model, ModelObject, ModelParameters, ObjectSnapshot, Output, State,
    Workspace, step, step_in,
};
use palpate_testkit::{GRAVITY_M_S2, Random, floor, free_block, half_extent, start_at};

const ROWS: usize = 3;
const STEPS: usize = 400;

/// Two blocks on each other on a floor, and two fingers, by nodes or by contact samples.
fn stacked(max_contact_samples: usize) -> Model {
    let block = free_block();
    let half = half_extent(&block, 1);
    let height = |at: f64| DVec3::Y * ((2.0 * at + 1.0) * half + 1e-3);
    let objects = [0.0, 1.0].map(|at| ModelObject::new(block.clone(), start_at(height(at))));
    let finger = DeviceParameters { tip_radius: 0.01, patch_radius: 0.02, ..DeviceParameters::default() };
    let parameters = ModelParameters {
        devices: vec![finger; 2],
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(0.5)],
        max_contact_samples,
        ..ModelParameters::for_reference()
    };
    Model::new(parameters, objects.to_vec()).expect("a good model")
}

/// Motion of the fingers in a row: about the blocks, through them and away.
struct Fingers {
    random: Random,
    goals: [DVec3; 2],
    positions: [DVec3; 2],
}

impl Fingers {
    fn new(row: usize) -> Self {
        let start = [DVec3::new(-0.3, 0.1, 0.0), DVec3::new(0.3, 0.1, 0.0)];
        Self { random: Random::new(row as u64 + 1), goals: start, positions: start }
    }

    fn next(&mut self) -> Input {
        for (goal, position) in self.goals.iter_mut().zip(&mut self.positions) {
            if self.random.chance(0.02) {
                *goal = self.random.vector() * 0.2 + DVec3::Y * 0.1;
            }
            *position += (*goal - *position) * 0.05;
        }
        let inactive = self.random.chance(0.01);
        let device =
            |position| if inactive { DeviceInput::inactive() } else { DeviceInput::touching(position) };
        Input { devices: self.positions.map(device).to_vec(), ..Input::default() }
    }
}

/// Output of the last step, and snapshots of the objects.
fn result(state: &State) -> (Output, Vec<ObjectSnapshot>) {
    (state.output().clone(), state.snapshots())
}

#[test]
fn states_that_share_buffers_go_on_as_with_their_own() {
    for max_contact_samples in [usize::MAX, 12] {
        let model = stacked(max_contact_samples);
        let mut fingers: Vec<Fingers> = (0..ROWS).map(Fingers::new).collect();
        let mut apart: Vec<State> = (0..ROWS).map(|_| State::new(&model)).collect();
        let mut sharing = apart.clone();
        sharing.iter_mut().for_each(State::release_workspace);
        let mut shared = Workspace::new(&model);
        let mut touching = 0;
        for number in 0..STEPS {
            for row in 0..ROWS {
                let input = fingers[row].next();
                step(&model, &mut apart[row], &input);
                step_in(&model, &mut sharing[row], &mut shared, &input);
                touching += usize::from(apart[row].output().devices[0].force_on_hand != DVec3::ZERO);
                assert_eq!(result(&sharing[row]), result(&apart[row]), "step {number}, row {row}");
            }
        }
        assert!(touching > STEPS / 10, "{touching}");
    }
}

#[test]
fn a_state_without_buffers_makes_new_ones() {
    let model = stacked(12);
    let (mut kept, mut released) = (State::new(&model), State::new(&model));
    let mut fingers = Fingers::new(0);
    for number in 0..STEPS {
        let input = fingers.next();
        step(&model, &mut kept, &input);
        if number % 7 == 0 {
            released.release_workspace();
        }
        step(&model, &mut released, &input);
        assert_eq!(result(&released), result(&kept), "step {number}");
    }
}
