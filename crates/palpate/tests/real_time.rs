//! A step allocates nothing, whatever the hands do.

use glam::DVec3;
use palpate::{
    DeviceInput, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Pose, Recording, State,
    SurfacePoint, Twist, step,
};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// Counts the allocations of each thread.
struct Counting;

// SAFETY: every call goes on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's layout, unchanged.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from the system's allocator with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the pointer came from the system's allocator with this layout.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn recording(bytes: &[u8]) -> Arc<Recording> {
    Arc::new(Recording::from_bytes(bytes).expect("a released recording"))
}

#[test]
fn a_step_makes_no_allocation() {
    let free = recording(include_bytes!("../../../data/recordings/v1/free.palp"));
    let fixed = recording(include_bytes!("../../../data/recordings/v1/fixed.palp"));
    let start =
        |x: f64| ObjectStart { pose: Pose { position: DVec3::X * x, ..Pose::IDENTITY }, twist: Twist::ZERO };
    let parameters = ModelParameters { devices: 4, gravity: DVec3::Y * -9.81, ..ModelParameters::default() };
    let model = Model::new(
        parameters,
        vec![ModelObject::new(free.clone(), start(0.0)), ModelObject::new(fixed, start(1.0))],
    )
    .expect("a good model");
    let mut state = State::new(&model);
    let grasp =
        |object, triangle| Some(Grasp { object, point: SurfacePoint { triangle, weights: [0.2, 0.3, 0.5] } });
    let mut input = Input { devices: vec![DeviceInput { position: DVec3::ZERO, grasp: None }; 4] };

    let before = ALLOCATIONS.get();
    for number in 0..200_u32 {
        // New grasps, old ones, none, one that does not exist, one on the same point, a hand that is no number.
        for (device, entry) in input.devices.iter_mut().enumerate() {
            let device = device as u32;
            entry.grasp = match (number / 7 + device) % 5 {
                0 => None,
                1 => grasp(0, device),
                2 => grasp(1, 3),
                3 => grasp(0, 999),
                _ => grasp(1, device),
            };
            let sway = f64::from((number * 31 + device * 17) % 101) / 101.0;
            entry.position = DVec3::new(f64::from(device), 0.1 * sway, 0.0);
            if number % 50 == 49 {
                entry.position.x = f64::NAN;
            }
        }
        step(&model, &mut state, &input);
    }
    assert_eq!(ALLOCATIONS.get() - before, 0, "allocations in 200 steps");

    // The counter counts.
    let probe = Box::new(0_u64);
    assert!(ALLOCATIONS.get() > before, "{probe}");
}
