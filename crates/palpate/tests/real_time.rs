//! Real time: a step allocates nothing, for any input.

use glam::DVec3;
use palpate::{
    AppliedForce, Clamp, ColumnsInMemory, Coupling, DeviceInput, DeviceMode, DeviceParameters, Grasp,
    ImpulseResponse, Input, Model, ModelObject, ModelParameters, ObjectStart, Obstacle, Pose, Recording,
    ResponseForm, Sampling, Shape, State, Twist, step,
};
use palpate_testkit::{
    CountingAllocator, GRAVITY_M_S2, allocations, finger, fixed_block, floor, free_block, half_extent,
    start_at, subdivided, with_stiffness_damping,
};
use std::sync::Arc;

#[global_allocator]
static COUNTING: CountingAllocator = CountingAllocator;

/// Table without coupling between nodes, with R[s] that decays over 50 samples.
fn table(recording: &Recording) -> ImpulseResponse {
    let (dofs, samples) = (3 * recording.surface.positions.len(), 50);
    let mut values = vec![0.0; dofs * samples * dofs];
    for (dof, sample) in (0..dofs).flat_map(|dof| (0..samples).map(move |sample| (dof, sample))) {
        values[(dof * samples + sample) * dofs + dof] = 0.01 * 0.9_f64.powi(sample as i32);
    }
    let numbers: Vec<u32> =
        recording.surface.source_nodes.iter().flat_map(|&n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    ImpulseResponse {
        step_s: 1e-3,
        samples,
        sampling: Sampling::End,
        touchable_dofs: numbers.clone(),
        observed_dofs: numbers,
        gravity: None,
        columns: Box::new(ColumnsInMemory::new(&values, samples * dofs, samples)),
    }
}

#[test]
fn step_makes_no_allocation() {
    let free = free_block();
    let start = |x: f64| start_at(DVec3::X * x);
    let parameters = ModelParameters {
        devices: vec![DeviceParameters::default(); 4],
        gravity: DVec3::Y * -GRAVITY_M_S2,
        ..ModelParameters::for_reference()
    };
    let convolved = ModelObject {
        response: ResponseForm::Fir(Arc::new(table(&free))),
        ..ModelObject::new(free.clone(), start(2.0))
    };
    let model = Model::new(
        parameters,
        vec![
            ModelObject::new(free.clone(), start(0.0)),
            ModelObject::new(fixed_block(), start(1.0)),
            convolved,
        ],
    )
    .expect("a good model");
    let mut state = State::new(&model);
    let grasp = |object, triangle| -> Option<Grasp> {
        Some(palpate_testkit::grasp(object, triangle, [0.2, 0.3, 0.5]))
    };
    let mut input = Input { devices: vec![DeviceInput::inactive(); 4], ..Input::default() };

    let before = allocations();
    for number in 0..200_u32 {
        // New and lasting grasps, none, one that does not exist, two on one point, a position that is not finite.
        for (device, entry) in input.devices.iter_mut().enumerate() {
            let device = device as u32;
            entry.mode = match (number / 7 + device) % 7 {
                0 => None,
                5 => grasp(2, device),
                6 => grasp(2, number / 2 % 90),
                1 => grasp(0, device),
                2 => grasp(1, 3),
                3 => grasp(0, 999),
                _ => grasp(1, device),
            }
            .into();
            if let (DeviceMode::Held(grasp), true) = (entry.mode, number % 3 == device % 3) {
                entry.mode = DeviceMode::Force(AppliedForce { grasp, force: DVec3::splat(0.01) });
            }
            let sway = f64::from((number * 31 + device * 17) % 101) / 101.0;
            entry.position = DVec3::new(f64::from(device), 0.1 * sway, 0.0);
            if number % 50 == 49 {
                entry.position.x = f64::NAN;
            }
        }
        step(&model, &mut state, &input);
    }
    assert_eq!(allocations() - before, 0, "allocations in 200 steps");

    // Prescribed forces, clamps that move and a base that moves.
    let end = (0..free.surface.triangles.len() as u32).filter(|t| {
        free.surface.triangles[*t as usize].iter().all(|n| free.surface.positions[*n as usize].x > 0.099)
    });
    let parameters = ModelParameters {
        devices: vec![DeviceParameters { patch_radius: 0.03, ..DeviceParameters::default() }],
        clamps: vec![Clamp::new(0, end.collect(), Pose::IDENTITY)],
        ..ModelParameters::for_reference()
    };
    let objects =
        vec![ModelObject::new(free.clone(), start(0.0)), ModelObject::new(fixed_block(), start(1.0))];
    let model = Model::new(parameters, objects).expect("a good model");
    let mut state = State::new(&model);
    let point = palpate::SurfacePoint { triangle: 3, weights: [0.2, 0.3, 0.5] };
    let mut input = Input {
        devices: vec![DeviceInput::inactive()],
        clamps: vec![Pose::IDENTITY],
        bases: vec![None; 2],
        ..Input::default()
    };
    let before = allocations();
    for number in 0..200_u32 {
        let t = f64::from(number) * 1e-3;
        let applied = AppliedForce { grasp: Grasp { object: 0, point }, force: DVec3::Y * t };
        input.devices[0] =
            if number % 40 < 30 { DeviceInput::exerting(applied) } else { DeviceInput::inactive() };
        input.clamps[0].position = DVec3::X * 0.01 * t;
        input.bases[1] = (number > 50).then_some(DVec3::X * (1.0 + t * t));
        step(&model, &mut state, &input);
        assert!(state.point_displacement(&model, 0, &point).is_finite());
    }
    assert_eq!(allocations() - before, 0, "allocations in 200 steps of loads");

    // Tips, a floor, a moving ball, two objects on one another.
    let coupling = Some(Coupling { stiffness: 200.0, damping: 0.1 });
    let finger = DeviceParameters { coupling, ..finger(0.004, 0.02, 0.5) };
    let plane = floor(0.5);
    let ball = Obstacle { shape: Shape::Sphere { radius: 0.03 }, ..plane.clone() };
    let parameters = ModelParameters {
        devices: vec![DeviceParameters { patch_radius: 0.0, ..finger }, finger],
        obstacles: vec![plane, ball],
        gravity: DVec3::Y * -GRAVITY_M_S2,
        ..ModelParameters::for_reference()
    };
    let lying = |y: f64| ObjectStart {
        twist: Twist { linear: DVec3::X * 0.1, angular: DVec3::Z * 2.0 },
        ..start_at(DVec3::Y * y)
    };
    let objects = [0.08, 0.2].map(|y| ModelObject::new(free.clone(), lying(y)));
    touch(&Model::new(parameters.clone(), objects.to_vec()).expect("a good model"), "of touching");
    fall_asleep_and_wake(parameters.clone(), &free);
    let finer = Arc::new(subdivided(&free, 3));
    let objects = [0.08, 0.2].map(|y| ModelObject::new(finer.clone(), lying(y)));
    let parameters = ModelParameters { max_contact_samples: 12, ..parameters };
    touch(&Model::new(parameters, objects.to_vec()).expect("a good model"), "with contact samples");
}

/// Three blocks fall asleep, a finger wakes one of them, and it falls asleep again.
fn fall_asleep_and_wake(parameters: ModelParameters, free: &Recording) {
    let block = with_stiffness_damping(free, 1e-2);
    let at = |x: f64| start_at(DVec3::new(x, half_extent(&block, 1), 0.0));
    let objects = [0.0, 1.0, 2.0].map(|x| ModelObject::new(block.clone(), at(x)));
    let mut parameters = ModelParameters { sleep_after_s: 0.05, ..parameters };
    parameters.obstacles.truncate(1);
    let model = Model::new(parameters, objects.to_vec());
    let model = model.expect("a good model");
    let input = |touches: bool| Input {
        devices: vec![
            if touches { DeviceInput::touching(DVec3::Y * 0.11) } else { DeviceInput::inactive() };
            2
        ],
        obstacles: vec![Pose::IDENTITY],
        ..Input::default()
    };
    let asleep = |state: &State| state.output().objects.iter().filter(|object| object.is_asleep).count();
    let mut state = State::new(&model);
    (0..3000).for_each(|_| _ = step(&model, &mut state, &input(false)));
    assert_eq!(asleep(&state), 3);
    let inputs = [input(false), input(true)];
    let before = allocations();
    (0..50).for_each(|_| _ = step(&model, &mut state, &inputs[1]));
    let woken = asleep(&state);
    (0..3000).for_each(|_| _ = step(&model, &mut state, &inputs[0]));
    assert_eq!(allocations() - before, 0, "allocations while objects wake and fall asleep");
    assert_eq!((woken, asleep(&state)), (2, 3));
}

/// Two fingers press the second of two objects that lie on one another while a ball comes.
fn touch(model: &Model, what: &str) {
    let mut state = State::new(model);
    let mut input = Input {
        devices: vec![DeviceInput::touching(DVec3::ZERO); 2],
        obstacles: vec![Pose::IDENTITY; 2],
        ..Input::default()
    };
    let (before, mut most) = (allocations(), 0);
    for number in 0..600_u32 {
        let t = f64::from(number) * 1e-3;
        let object = state.output().objects[1].pose.position;
        let reach = 0.14 - 0.06 * t;
        input.devices[0].position = object + DVec3::new(reach, 0.01 * (20.0 * t).sin(), 0.0);
        input.devices[1].position = object - DVec3::X * reach * if number % 97 == 0 { -1.0 } else { 1.0 };
        input.obstacles[1].position = DVec3::new(0.0, 0.05, 0.2 - 0.3 * t);
        most = most.max(step(model, &mut state, &input).contacts.len());
    }
    assert_eq!(allocations() - before, 0, "allocations in 600 steps {what}");
    assert!(most > 5, "{most} contacts at once");

    // The counter works: the boxed probe is counted.
    let probe = Box::new(0_u64);
    assert!(allocations() > before, "{probe}");
}
