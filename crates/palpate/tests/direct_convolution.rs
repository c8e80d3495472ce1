//! Direct convolution of a recorded table: forces equal to those of the modal form, for any contacts.

use glam::DVec3;
use palpate::{
    AppliedForce, DeviceInput, DeviceParameters, Grasp, ImpulseResponse, Input, Model, ModelObject,
    ModelParameters, ObjectStart, Recording, ResponseForm, State, SurfacePoint, Twist, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, Random, closed_form_table, fixed_block, free_block, holding, model_and_state, start_at,
    with_stiffness_damping,
};
use std::sync::Arc;

const H: f64 = 1e-3;

fn scene(recording: &Arc<Recording>, form: ResponseForm, parameters: ModelParameters) -> (Model, State) {
    let twist = match recording.metadata.support {
        palpate::Support::Free => {
            Twist { linear: DVec3::new(0.1, 0.0, -0.05), angular: DVec3::new(1.0, -2.0, 0.5) }
        }
        palpate::Support::Fixed => Twist::ZERO,
    };
    let start = ObjectStart { twist, ..start_at(DVec3::ZERO) };
    let object = ModelObject { response: form, ..ModelObject::new(recording.clone(), start) };
    model_and_state(parameters, vec![object])
}

/// Movable points of a recording, one per triangle, with all three weights.
fn points(recording: &Recording) -> Vec<SurfacePoint> {
    let point = |triangle: u32| SurfacePoint { triangle, weights: [0.2, 0.3, 0.5] };
    let all = (0..recording.surface.triangles.len() as u32).map(point);
    all.filter(|point| recording.is_movable(point)).collect()
}

/// Largest relative difference of forces and of surface displacements between the two forms [1], with two hands whose grasps
/// at each step `grasps` gives.
fn differences(
    recording: &Arc<Recording>,
    samples: usize,
    steps: usize,
    gravity: DVec3,
    grasps: impl Fn(usize) -> [Option<SurfacePoint>; 2],
) -> (f64, f64) {
    let parameters = ModelParameters {
        devices: vec![DeviceParameters::default(); 2],
        gravity,
        ..ModelParameters::for_reference()
    };
    let fir = ResponseForm::Fir(Arc::new(closed_form_table(recording, samples, H)));
    let mut scenes = [ResponseForm::Modal, fir].map(|form| scene(recording, form, parameters.clone()));
    let nodes = recording.surface.positions.len();
    let (mut worst, mut largest) = ([0.0_f64; 2], [0.0_f64; 2]);
    for number in 0..steps {
        let t = number as f64 * H;
        let devices = grasps(number).into_iter().enumerate().map(|(device, point)| {
            // Hands sway about the points of the moving body.
            let pose = scenes[0].1.output().objects[0].pose;
            let sway =
                3e-4 * DVec3::new((40.0 * t).sin(), (70.0 * t).cos(), (25.0 * t + device as f64).sin());
            let rest = point.map_or(DVec3::ZERO, |p| recording.surface.rest_position(&p));
            let grasp = point.map(|point| Grasp { object: 0, point });
            DeviceInput { position: pose.world_from_body(rest) + sway, mode: grasp.into() }
        });
        let input = Input { devices: devices.collect(), ..Input::default() };
        let mut forces = [[DVec3::ZERO; 2]; 2];
        let mut shapes = [vec![DVec3::ZERO; nodes], vec![DVec3::ZERO; nodes]];
        for (at, (model, state)) in scenes.iter_mut().enumerate() {
            let output = step(model, state, &input);
            assert_eq!(output.status.rejected_inputs + output.status.unsolved_islands, 0, "step {number}");
            forces[at] = [output.devices[0].force_on_hand, output.devices[1].force_on_hand];
            state.surface_displacement(model, 0, &mut shapes[at]);
        }
        for (modal, fir) in forces[0].iter().zip(&forces[1]) {
            worst[0] = worst[0].max((*modal - *fir).length());
            largest[0] = largest[0].max(modal.length());
        }
        for (modal, fir) in shapes[0].iter().zip(&shapes[1]) {
            worst[1] = worst[1].max((*modal - *fir).length());
            largest[1] = largest[1].max(modal.length());
        }
    }
    assert!(
        largest[0] > LEAST_FORCE_N && largest[1] > LEAST_DISPLACEMENT_M,
        "the hands do something: {largest:?}"
    );
    (worst[0] / largest[0], worst[1] / largest[1])
}

/// Force [N] and displacement [m] that hands of a test cause at least, so that there is something to compare.
const LEAST_FORCE_N: f64 = 1e-3;
const LEAST_DISPLACEMENT_M: f64 = 1e-6;

/// Relative round-off of sums of a few hundred terms in another order, and of a system with condition below 1e3 [1].
const ROUND_OFF: f64 = 1e-11;

#[test]
fn forces_and_displacements_equal_those_of_the_modal_form() {
    // Residual compliance that relaxes within a fifth of a step, and in ten steps.
    for recording in [free_block(), with_stiffness_damping(&free_block(), 10.0 * H)] {
        let held = points(&recording);
        let (force, shape) =
            differences(&recording, 300, 300, DVec3::ZERO, |_| [Some(held[3]), Some(held[held.len() / 2])]);
        assert!(force < ROUND_OFF && shape < ROUND_OFF, "{force:e} {shape:e}");
    }
}

/// Held points are solved for with blocked convolution; `State::point_displacement` sums each output by itself.
#[test]
fn blocks_give_the_sums_of_single_outputs_whatever_comes_and_goes_and_is_forgotten() {
    let recording = fixed_block();
    let held = points(&recording);
    // Windows below, at and above a block, and some blocks.
    for samples in [7, 16, 40, 130] {
        let parameters = ModelParameters {
            devices: vec![DeviceParameters::default(); 3],
            ..ModelParameters::for_reference()
        };
        let form = ResponseForm::Fir(Arc::new(closed_form_table(&recording, samples, H)));
        let (model, mut state) = scene(&recording, form, parameters);
        let mut random = Random::new(5);
        let mut grasps = [None; 3];
        let (mut largest, mut strongest) = (0.0_f64, 0.0_f64);
        for number in 0..600 {
            let t = f64::from(number) * H;
            for (hand, grasp) in grasps.iter_mut().enumerate() {
                // A hand keeps its point for 20 steps in the mean, and holds none for as long; no two hold the same.
                if random.chance(0.05) {
                    let at = (random.unit() * (held.len() / 3) as f64) as usize;
                    *grasp = random.chance(0.5).then_some(held[3 * at + hand]);
                }
            }
            let pose = state.output().objects[0].pose;
            let devices = grasps.iter().map(|grasp| {
                let rest = grasp.map_or(DVec3::ZERO, |point| recording.surface.rest_position(&point));
                let sway = 3e-4 * DVec3::new((40.0 * t).sin(), (70.0 * t).cos(), (25.0 * t).sin());
                let mode = grasp.map(|point| Grasp { object: 0, point }).into();
                DeviceInput { position: pose.world_from_body(rest) + sway, mode }
            });
            let input = Input { devices: devices.collect(), ..Input::default() };
            let output = step(&model, &mut state, &input);
            assert_eq!(output.status.unsolved_islands, 0, "step {number}");
            let pose = output.objects[0].pose;
            let forces = output.devices.iter().map(|device| device.force_on_hand.length());
            strongest = forces.fold(strongest, f64::max);
            for (at, grasp) in grasps.iter().enumerate() {
                let Some(point) = grasp else { continue };
                let u = state.point_displacement(&model, 0, point);
                let place = pose.world_from_body(recording.surface.rest_position(point) + u);
                let apart = (place - input.devices[at].position).length();
                assert!(apart < HELD_M_N * (1.0 + strongest), "{apart:e} m in step {number}, T = {samples}");
                largest = largest.max(u.length());
            }
        }
        assert!(largest > LEAST_DISPLACEMENT_M, "{largest}");
    }
}

/// Round-off of the place of a held point per force [m/N]: the solver's tolerance of 10⁻¹⁰ by compliances of 10⁻³ m/N at most.
const HELD_M_N: f64 = 1e-13;

#[test]
fn prescribed_forces_displace_as_in_modal_form() {
    for recording in [free_block(), with_stiffness_damping(&free_block(), 10.0 * H)] {
        let (held, fir) =
            (points(&recording), ResponseForm::Fir(Arc::new(closed_form_table(&recording, 300, H))));
        let devices = vec![DeviceParameters::default(); 2];
        let parameters = ModelParameters { devices, ..ModelParameters::for_reference() };
        let mut scenes = [ResponseForm::Modal, fir].map(|form| scene(&recording, form, parameters.clone()));
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for number in 0..300 {
            let t = f64::from(number) * H;
            let force = DVec3::new((40.0 * t).sin(), (70.0 * t).cos(), (25.0 * t).sin());
            let on = |at: usize, force| {
                let grasp = Grasp { object: 0, point: held[at] };
                DeviceInput::exerting(AppliedForce { grasp, force })
            };
            let devices = vec![on(3, force), on(held.len() / 2, -force)];
            let input = Input { devices, ..Input::default() };
            let [modal, fir] = scenes.each_mut().map(|(model, state)| step(model, state, &input).clone());
            let probe = |(model, state): &(Model, State)| state.point_displacement(model, 0, &held[7]);
            assert!((probe(&scenes[0]) - probe(&scenes[1])).length() < ROUND_OFF, "{number}");
            for (a, b) in modal.devices.iter().zip(&fir.devices) {
                worst = worst.max((a.proxy - b.proxy).length());
                largest = largest.max(a.proxy.length());
            }
            assert!(fir.energy.defect.abs() < ROUND_OFF * fir.energy.stored(), "{:?}", fir.energy);
        }
        assert!(worst < ROUND_OFF * largest, "{worst} {largest}");
    }
}

/// Relative round-off where every step brings new points to the hands: it is fed back and amplified [1].
const FED_BACK: f64 = 1e-9;

#[test]
fn history_holds_contacts_that_appear_vanish_and_move() {
    let recording = free_block();
    let held = points(&recording);
    // Another point every second step, more points than copies of series; the second hand releases its point at times.
    let (force, shape) = differences(&recording, 300, 300, DVec3::ZERO, |number| {
        let first = held[(number / 2 * 7) % held.len()];
        let second = held[(number / 40 * 5 + 3) % held.len()];
        [Some(first), (number % 40 < 25 && first != second).then_some(second)]
    });
    assert!(force < FED_BACK && shape < FED_BACK, "{force:e} {shape:e}");
}

#[test]
fn a_body_with_fixed_nodes_sags_under_gravity_as_in_modal_form() {
    let recording = fixed_block();
    let held = points(&recording);
    let gravity = DVec3::new(1.0, -GRAVITY_M_S2, 0.5);
    let (force, shape) = differences(&recording, 300, 300, gravity, |number| {
        [(number > 50).then_some(held[2]), (number % 100 < 60).then_some(held[held.len() / 2])]
    });
    assert!(force < ROUND_OFF && shape < ROUND_OFF, "{force:e} {shape:e}");
}

#[test]
fn forces_older_than_the_window_have_no_effect() {
    let recording = free_block();
    let held = points(&recording);
    let samples = 20;
    let form = ResponseForm::Fir(Arc::new(closed_form_table(&recording, samples, H)));
    let (model, mut state) = scene(
        &recording,
        form,
        ModelParameters { devices: vec![DeviceParameters::default(); 1], ..ModelParameters::for_reference() },
    );
    let rest = recording.surface.rest_position(&held[0]);
    step(&model, &mut state, &holding(rest + DVec3::X * 1e-3, Grasp { object: 0, point: held[0] }));
    let mut shape = vec![DVec3::ZERO; recording.surface.positions.len()];
    for number in 1..=samples {
        state.surface_displacement(&model, 0, &mut shape);
        assert!(shape.iter().any(|u| *u != DVec3::ZERO), "step {number}");
        step(&model, &mut state, &Input { devices: vec![], ..Input::default() });
    }
    state.surface_displacement(&model, 0, &mut shape);
    assert!(shape.iter().all(|u| *u == DVec3::ZERO));
}

/// Round-off of an energy ledger [1], relative to what moved: four hundred sums with terms of that size.
const LEDGER_ROUND_OFF: f64 = 1e-13;

#[test]
fn work_of_hands_is_stored_in_motion_and_deformation() {
    let recording = free_block();
    let held = points(&recording);
    let form = ResponseForm::Fir(Arc::new(closed_form_table(&recording, 200, H)));
    let (model, mut state) = scene(
        &recording,
        form,
        ModelParameters { devices: vec![DeviceParameters::default(); 1], ..ModelParameters::for_reference() },
    );
    let rest = recording.surface.rest_position(&held[5]);
    for number in 1..400 {
        let position = rest + DVec3::new(0.0, 3e-3 * (0.05 * f64::from(number)).sin(), 0.0);
        let grasp = (number % 90 < 70).then_some(Grasp { object: 0, point: held[5] });
        let energy = step(
            &model,
            &mut state,
            &Input { devices: vec![DeviceInput { position, mode: grasp.into() }], ..Input::default() },
        )
        .energy;
        assert!(
            energy.defect.abs() < LEDGER_ROUND_OFF * (energy.input.abs() + energy.stored()),
            "{number}: {energy:?}"
        );
    }
}

#[test]
fn tables_that_do_not_fit_are_refused() {
    let recording = free_block();
    let refusal = |change: &dyn Fn(&mut ImpulseResponse)| {
        let mut table = closed_form_table(&recording, 5, H);
        change(&mut table);
        let object = ModelObject {
            response: ResponseForm::Fir(Arc::new(table)),
            ..ModelObject::new(recording.clone(), start_at(DVec3::ZERO))
        };
        Model::new(ModelParameters::for_reference(), vec![object])
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default()
    };
    assert_eq!(
        refusal(&|table| table.step_s = 2e-3),
        "object 0: the impulse response was recorded with a step of 0.002 s, the scene's step is 0.001 s"
    );
    assert_eq!(
        refusal(&|table| table.samples = 4),
        format!(
            "object 0: columns of the impulse response hold {} numbers, expected {}",
            15 * recording.surface.positions.len(),
            12 * recording.surface.positions.len()
        )
    );
    assert_eq!(
        refusal(&|table| table.observed_dofs[0] = u32::MAX),
        "object 0: the impulse response has touchable nodes that are not observed"
    );
    assert_eq!(refusal(&|table| table.samples = 0), "object 0: the impulse response holds nothing");
}

#[test]
fn untouchable_point_cannot_be_held() {
    let recording = free_block();
    let mut table = closed_form_table(&recording, 5, H);
    // The first node's first column belongs to another degree of freedom.
    table.touchable_dofs[0] = u32::MAX;
    let node = recording.surface.triangles.iter().position(|t| t.contains(&0)).expect("a triangle") as u32;
    let point = SurfacePoint { triangle: node, weights: [1.0 / 3.0; 3] };
    assert_eq!(
        table.prepare(&recording.surface, &point).err().map(|e| e.to_string()).unwrap_or_default(),
        format!(
            "the point is not touchable in the impulse response: node {} was left out when it was recorded",
            recording.surface.source_nodes[0]
        )
    );
    let (model, mut state) = scene(
        &recording,
        ResponseForm::Fir(Arc::new(table)),
        ModelParameters { devices: vec![DeviceParameters::default(); 1], ..Default::default() },
    );
    let held = holding(DVec3::ZERO, Grasp { object: 0, point });
    assert_eq!(step(&model, &mut state, &held).status.rejected_inputs, 1);
}

#[test]
fn a_table_of_a_fixed_body_knows_constant_gravity_alone_and_starts_undeformed() {
    let recording = fixed_block();
    let object = ModelObject {
        response: ResponseForm::Fir(Arc::new(closed_form_table(&recording, 5, H))),
        ..ModelObject::new(recording, start_at(DVec3::ZERO))
    };
    let model = Model::new(ModelParameters::for_reference(), vec![object.clone()]).expect("a good model");
    let mut state = State::new(&model);
    let same = Input { gravity: Some(DVec3::ZERO), ..Input::default() };
    assert_eq!(step(&model, &mut state, &same).status.rejected_inputs, 0);
    let changed = Input { gravity: Some(DVec3::Y), ..Input::default() };
    assert_eq!(step(&model, &mut state, &changed).status.rejected_inputs, 1);
    let object = ModelObject { deformation: palpate::InitialDeformation::Equilibrium, ..object };
    let refused =
        Model::new(ModelParameters::for_reference(), vec![object]).expect_err("it starts undeformed");
    assert_eq!(refused.to_string(), "object 0: uses a table, which starts undeformed: use the modal form");
}

#[test]
fn a_point_whose_free_corner_has_no_weight_to_speak_of_is_refused_as_fixed() {
    let block = fixed_block();
    let corner = |triangle: u32, at: usize| SurfacePoint {
        triangle,
        weights: std::array::from_fn(|k| f64::from(u8::from(k == at))),
    };
    let moves = |triangle: u32, at: usize| block.is_movable(&corner(triangle, at));
    let triangles = 0..block.surface.triangles.len() as u32;
    // One corner of three moves; it has the weight that round-off leaves.
    let (triangle, free) = triangles
        .flat_map(|triangle| (0..3).map(move |at| (triangle, at)))
        .find(|&(triangle, at)| moves(triangle, at) && (1..3).all(|k| !moves(triangle, (at + k) % 3)))
        .expect("a triangle at the fixed end");
    let mut weights = [0.5; 3];
    weights[free] = 1e-16;
    let point = SurfacePoint { triangle, weights };
    let table = Arc::new(closed_form_table(&block, 4, H));
    let refusal = table.prepare(&block.surface, &point).map_err(|error| error.to_string());
    let expected = "the point lies on fixed nodes: no hand can move it; hold one that is farther from them";
    assert_eq!(refusal, Err(expected.into()));
    let parameters =
        ModelParameters { devices: vec![DeviceParameters::default()], ..ModelParameters::for_reference() };
    let (model, mut state) = scene(&block, ResponseForm::Fir(table), parameters);
    let position = block.surface.rest_position(&point) + DVec3::Y * 0.01;
    let output = step(&model, &mut state, &holding(position, Grasp { object: 0, point }));
    assert_eq!((output.status.rejected_inputs, output.devices[0].force_on_hand), (1, DVec3::ZERO));
    assert_eq!(output.energy.stored(), 0.0);
}
