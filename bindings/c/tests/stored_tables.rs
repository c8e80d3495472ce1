//! Objects on stored tables: what a new point or a tip needs is read when a program asks for it, not within a step.

use palpate::Sampling;
use palpate_c::{
    DeviceInput, DeviceMode, DeviceOutput, Error, Purpose, Scene, State, Status, Vector, palpate_scene_free,
    palpate_scene_load, palpate_state_device_input, palpate_state_devices, palpate_state_free,
    palpate_state_nearest_point, palpate_state_new, palpate_state_point_position, palpate_state_set_device,
    palpate_state_step,
};
use palpate_store::{Compression, Location, Number, TableAttributes, TableContent, TableStore};
use palpate_testkit::free_block;
use std::ffi::CString;
use std::path::Path;
use std::ptr;
use tempfile::TempDir;

/// A cube on a stored table, alone with a hand that holds it on one side.
const SCENE: &str = r#"
[[object]]
name = "cube"
recording = "cube.palp"
response = "fir"
table = "t.zarr"

[[device]]
name = "hand"
mode = "held"
attach = { object = "cube", point = [0.1, 0.0, 0.0] }
"#;

const SAMPLES: usize = 4;

/// Response of a node to a force on it, in the first sample [m/N].
const COMPLIANCE: f64 = 1e-3;

/// Store in which every node answers forces on it alone.
fn write_store(folder: &Path) {
    let recording = free_block();
    let surface = recording.surface.clone();
    let mut dofs: Vec<u32> =
        surface.source_nodes.iter().flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    dofs.sort_unstable();
    let observed = dofs.len();
    let content = TableContent {
        attributes: TableAttributes {
            store_version: palpate_store::STORE_VERSION,
            step_s: 1e-3,
            sampling: TableAttributes::sampling_text(Sampling::End),
            method: "closed-form".into(),
            columns_per_shard: 5,
            compression: Compression::None,
            recording: recording.metadata.clone(),
        },
        number: Number::F64,
        samples: SAMPLES,
        observed_positions: surface.positions.clone(),
        touchable_dofs: dofs.clone(),
        observed_dofs: dofs,
        surface,
        gravity: None,
    };
    let location = Location::Folder(folder.to_path_buf());
    let store = TableStore::create(&location, content, || None).expect("a writable folder");
    for shard in 0..store.shards() {
        let column = |own: usize| -> Vec<f64> {
            let response = |at: usize| if at % observed == own { COMPLIANCE } else { 0.0 };
            (0..SAMPLES * observed).map(response).collect()
        };
        store.write_shard(shard, store.columns_of(shard).map(column).collect()).expect("a writable folder");
    }
}

/// State of a scene with its files.
struct Held {
    folder: TempDir,
    state: *mut State,
}

impl Held {
    fn new() -> Self {
        let folder = TempDir::new().expect("a folder");
        let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect(name);
        write("cube.palp", &free_block().to_bytes().expect("bytes"));
        write("scene.toml", SCENE.as_bytes());
        write_store(&folder.path().join("t.zarr"));
        let path = folder.path().join("scene.toml").into_os_string().into_string().expect("text");
        let path = CString::new(path).expect("text");
        let (mut scene, mut state): (*mut Scene, *mut State) = (ptr::null_mut(), ptr::null_mut());
        // SAFETY: places of their types; the scene is freed once.
        unsafe {
            let mut error = std::mem::zeroed::<Error>();
            let loaded =
                palpate_scene_load(path.as_ptr(), Purpose::Offline as u32, &raw mut scene, &raw mut error);
            assert_eq!(loaded, Status::Ok, "{}", text(&error));
            assert_eq!(palpate_state_new(scene, &raw mut state, ptr::null_mut()), Status::Ok);
            palpate_scene_free(scene);
        }
        Self { folder, state }
    }

    /// Input of the hand.
    fn input(&self) -> DeviceInput {
        let mut input = std::mem::MaybeUninit::uninit();
        // SAFETY: a state, and a place for its type, which is filled.
        unsafe {
            assert_eq!(palpate_state_device_input(self.state, 0, input.as_mut_ptr()), Status::Ok);
            input.assume_init()
        }
    }

    /// Input of a hand that holds the point nearest to a place, a millimetre away from it.
    fn grasp(&self, place: Vector) -> DeviceInput {
        let mut input = DeviceInput { mode: DeviceMode::Held as u32, ..self.input() };
        // SAFETY: a state, and places of their types.
        unsafe {
            let found = palpate_state_nearest_point(self.state, 0, place, &raw mut input.point);
            assert_eq!(found, Status::Ok);
            let found = palpate_state_point_position(self.state, input.point, &raw mut input.position);
            assert_eq!(found, Status::Ok);
        }
        input.position.z += 0.001;
        input
    }

    fn set(&self, input: &DeviceInput) -> (Status, String) {
        // SAFETY: a state, an input, and a place for an error, of which zeros are one.
        unsafe {
            let mut error = std::mem::zeroed::<Error>();
            let status = palpate_state_set_device(self.state, 0, input, &raw mut error);
            (status, text(&error))
        }
    }

    /// Output of the hand in the next step.
    fn step(&self) -> DeviceOutput {
        // SAFETY: a state with one device.
        unsafe {
            assert_eq!(palpate_state_step(self.state), Status::Ok);
            *palpate_state_devices(self.state, ptr::null_mut())
        }
    }

    /// Delete the numbers of the store.
    fn lose_columns(&self) {
        std::fs::remove_dir_all(self.folder.path().join("t.zarr/impulse_response/c")).expect("columns");
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        // SAFETY: made by `palpate_state_new`, and freed once.
        unsafe { palpate_state_free(self.state) };
    }
}

fn text(error: &Error) -> String {
    let bytes = error.message.iter().map(|byte| *byte as u8).take_while(|byte| *byte != 0);
    String::from_utf8(bytes.collect()).expect("UTF-8")
}

const OTHER_SIDE: Vector = Vector { x: -0.1, y: 0.0, z: 0.0 };

#[test]
fn columns_of_a_new_point_are_read_when_it_is_held() {
    let (kept, lost) = (Held::new(), Held::new());
    for held in [&kept, &lost] {
        assert_eq!(held.set(&held.grasp(OTHER_SIDE)), (Status::Ok, String::new()));
    }
    lost.lose_columns();
    let (kept, lost) = (kept.step().force_on_hand, lost.step().force_on_hand);
    assert_eq!(kept, lost);
    assert!(kept.z < -1e-3, "the hand pulls: {kept:?}");
}

#[test]
fn columns_that_are_lost_are_an_error_when_they_are_needed_and_no_rigid_point() {
    let held = Held::new();
    let own = held.grasp(Vector { x: 0.1, y: 0.0, z: 0.0 });
    let other = held.grasp(OTHER_SIDE);
    held.lose_columns();
    let (status, message) = held.set(&other);
    assert_eq!(status, Status::Table, "{message}");
    assert!(message.starts_with("object \"cube\": ") && message.contains("t.zarr"), "{message}");
    let touch = DeviceInput { mode: DeviceMode::Touch as u32, ..own };
    let (status, message) = held.set(&touch);
    assert_eq!(status, Status::Table, "{message}");
    // The point of the scene is in memory, and the device has not changed.
    assert_eq!(held.set(&own), (Status::Ok, String::new()));
    assert!(held.step().force_on_hand.z < -1e-3);
}
