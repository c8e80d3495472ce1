//! Live scene.

use super::client::{TestServer, mode_shapes};
use glam::DVec3;
use palpate_testkit::{free_block, half_extent};

/// Difference of modal and vertex frames, as a share of the largest displacement [1]: half floats, and residuals to 1/127.
const FORMAT_ROUNDING: f64 = 0.006;

/// Displacement of a body that is pressed [m], at least.
const PRESSED_M: f64 = 1e-5;

#[test]
fn a_page_receives_the_scene_its_static_data_and_frames() {
    let served = TestServer::live();
    let mut page = served.page();
    let hello = page.wait("hello");
    assert_eq!((&hello["kind"], &hello["protocol"]), (&"live".into(), &2.into()));
    assert_eq!(hello["scenes"][0]["id"], "float");
    let scene = page.wait("scene");
    let generation = scene["generation"].as_u64().expect("a generation");
    let recording = free_block();
    assert_eq!(scene["objects"][0]["nodes"], recording.surface.positions.len());
    assert_eq!(scene["obstacles"][0]["shape"], serde_json::json!({ "plane": {} }));
    assert_eq!(scene["devices"][1]["pointer"], true);
    let (status, surface) = served.get(&format!("/scene/{generation}/object/0/surface"));
    let (n, t) = (recording.surface.positions.len(), recording.surface.triangles.len());
    assert_eq!((status, surface.len()), (200, 8 + 12 * (n + t)));
    let (status, bytes) = served.get(&format!("/scene/{generation}/object/0/mode_shapes"));
    assert_eq!((status, mode_shapes(&bytes).len()), (200, recording.modes.len()));
    for missing in
        ["/scene/999/object/0/surface", "/scene/1/object/7/mode_shapes", "/scene/1/obstacle/0/surface"]
    {
        assert_eq!(served.get(missing).0, 404, "{missing}");
    }
    let shapes = mode_shapes(&bytes);
    let first = page.frame(&shapes, |frame| frame.step > 0);
    let later = page.frame(&shapes, |frame| frame.step > first.step + 50);
    assert!(later.time_s > first.time_s && later.generation as u64 == generation);
    let status = page.wait("status");
    assert_eq!((&status["paused"], &status["viewers"]), (&false.into(), &1.into()));
    assert!(status["force_process"]["compute_us"]["p999"].as_f64().is_some());
}

#[test]
fn a_pointer_presses_the_body_and_both_formats_give_the_same_surface() {
    let served = TestServer::live();
    let (mut page, mut other) = (served.page(), served.page());
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = mode_shapes(&served.get(&format!("/scene/{generation}/object/0/mode_shapes")).1);
    let radius = free_block().surface.radius();
    let low = -half_extent(&free_block(), 0);
    let at = |x: f64| format!("[{x:?},0.001,-0.001]");
    let start = low - 0.15 * radius;
    page.send(&format!(r#"{{"type":"press","pointer":3,"mode":"touch","position":{}}}"#, at(start)));
    assert_eq!(page.wait("assigned")["device"], 0);
    // The other page gets the other device slot; a third pointer gets none.
    other.send(&format!(r#"{{"type":"press","pointer":3,"mode":"touch","position":{}}}"#, at(-9.0)));
    assert_eq!(other.wait("assigned")["device"], 1);
    other.send(&format!(r#"{{"type":"press","pointer":4,"mode":"touch","position":{}}}"#, at(-9.0)));
    assert!(other.wait("assigned")["device"].is_null());
    page.send(r#"{"type":"slow_motion","slowdown":10}"#);
    let deep = at(start + 0.2 * radius);
    page.send(&format!(r#"{{"type":"move","pointers":[{{"pointer":3,"position":{deep}}}]}}"#));
    let pressed = page.frame(&shapes, |frame| frame.devices[0].2.length() > 0.02);
    let (mode, _, force) = pressed.devices[0];
    assert!(mode == 1 && force.x < 0.0 && force.x.abs() > 5.0 * force.y.hypot(force.z), "{force}");
    // While paused, both formats are of the same step.
    page.send(r#"{"type":"pause","paused":true}"#);
    while page.wait("status")["paused"] != true {}
    other.send(r#"{"type":"stream","format":"vertices","stride":1}"#);
    // The first vertex frame may be of the initial state.
    other.frame(&shapes, |frame| frame.format == 2);
    page.send(r#"{"type":"single_step"}"#);
    let vertices = other.frame(&shapes, |frame| frame.format == 2 && frame.step > 0);
    let modal = page.frame(&shapes, |frame| frame.step == vertices.step);
    let rest = free_block().surface.positions.clone();
    let moved = |positions: &[DVec3]| -> f64 {
        positions.iter().zip(&rest).map(|(place, rest)| (*place - *rest).length()).fold(0.0, f64::max)
    };
    let most = moved(&vertices.positions);
    assert!(most > PRESSED_M, "{most} m");
    for (node, (a, b)) in modal.positions.iter().zip(&vertices.positions).enumerate() {
        assert!((*a - *b).length() < FORMAT_ROUNDING * most, "{node}: {a} {b} of {most}");
    }
    assert!(modal.bytes < vertices.bytes, "{} {}", modal.bytes, vertices.bytes);
    // A page that leaves releases its pointers.
    drop(page);
    other.send(r#"{"type":"pause","paused":false}"#);
    other.frame(&shapes, |frame| frame.devices[0].0 == 0);
}

#[test]
fn a_held_point_follows_the_pointer_and_invalid_grasps_are_refused() {
    let served = TestServer::live();
    let mut page = served.page();
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = mode_shapes(&served.get(&format!("/scene/{generation}/object/0/mode_shapes")).1);
    for wrong in [
        r#""object":0,"triangle":99999999,"weights":[1,0,0]"#,
        r#""object":7,"triangle":0,"weights":[1,0,0]"#,
        r#""object":0,"triangle":0,"weights":[-1,1,1]"#,
        r#""object":0"#,
    ] {
        page.send(&format!(r#"{{"type":"press","pointer":1,"mode":"hold","position":[0,0,0],{wrong}}}"#));
        let text = page.wait("error")["text"].to_string();
        assert!(text.contains("a hold needs an object"), "{text}");
    }
    let surface = &free_block().surface;
    let corners = surface.triangles[5].map(|node| surface.positions[node as usize]);
    let place = (corners[0] + corners[1] + corners[2]) / 3.0;
    let at = |place: DVec3| format!("[{:?},{:?},{:?}]", place.x, place.y, place.z);
    let grasp = r#""object":0,"triangle":5,"weights":[1,1,1]"#;
    page.send(&format!(r#"{{"type":"press","pointer":1,"mode":"hold","position":{},{grasp}}}"#, at(place)));
    assert_eq!(page.wait("assigned")["device"], 0);
    let away = at(place + DVec3::new(0.02, 0.01, 0.0));
    page.send(&format!(r#"{{"type":"move","pointers":[{{"pointer":1,"position":{away}}}]}}"#));
    let pulled = page.frame(&shapes, |frame| frame.position.x > 0.005);
    assert_eq!(pulled.devices[0].0, 2);
}

#[test]
fn physics_changes_keep_the_state_and_reset_restarts() {
    let served = TestServer::live();
    let mut page = served.page();
    let first = page.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = mode_shapes(&served.get(&format!("/scene/{first}/object/0/mode_shapes")).1);
    page.send(r#"{"type":"set_physics","gravity":[0,-9.81,0]}"#);
    let falling = page.wait("scene");
    assert_eq!((&falling["generation"], &falling["gravity"][1]), (&(first + 1).into(), &(-9.81).into()));
    let fallen = page.frame(&shapes, |frame| frame.position.y < -0.01);
    // Without gravity again, it resumes from there.
    page.send(r#"{"type":"set_physics","gravity":[0,0,0],"step":0.002}"#);
    assert_eq!(page.wait("scene")["step_s"], 0.002);
    // A viewer that comes now learns the settings that the scene was opened with.
    let came = served.page().wait("scene");
    let own = &came["own"];
    assert_eq!(
        (&came["step_s"], &own["step_s"], &own["gravity"][1]),
        (&0.002.into(), &0.001.into(), &0.0.into())
    );
    let (materials, devices) = (&own["materials"], &own["devices"]);
    assert_eq!((&materials[0], devices), (&came["objects"][0]["material"], &came["devices"]));
    let on = page.frame(&shapes, |frame| frame.generation as u64 == first + 2);
    assert!(on.position.y <= fallen.position.y, "{} {}", on.position, fallen.position);
    page.send(r#"{"type":"reset"}"#);
    page.wait("scene");
    let restarted = page.frame(&shapes, |frame| frame.generation as u64 == first + 3);
    assert_eq!(restarted.position, DVec3::ZERO);
    assert_eq!(served.page().wait("scene")["own"]["step_s"], 0.001);
    // A failed command is reported, and the scene keeps running.
    page.send(r#"{"type":"open_scene","scene":"nowhere"}"#);
    assert_eq!(page.wait("error")["text"], "there is no scene \"nowhere\"");
    page.send(r#"{"type":"open_scene","scene":"float"}"#);
    assert_eq!(page.wait("progress")["job"], "scene");
    assert_eq!(page.wait("scene")["generation"], first + 4);
    let mesh = vec![b'x'; 300_000];
    let (status, _) = served.request("POST /record?name=a.msh&young=1&poisson=0.3&density=1", &mesh);
    assert_eq!(status, 202);
    assert_eq!(page.wait("error")["text"], "300000 bytes of a.msh");
}

#[test]
fn only_one_job_runs_at_a_time() {
    let (served, open_gate) = TestServer::live_with_gate();
    let mut page = served.page();
    page.wait("scene");
    let record = |name: &str| {
        served.request(&format!("POST /record?name={name}&young=1&poisson=0.3&density=1"), b"xyz")
    };
    assert_eq!(record("slow.msh").0, 202);
    let busy = "a recording is under way: ask again when it is done";
    let (status, text) = record("b.msh");
    assert_eq!((status, String::from_utf8_lossy(&text).as_ref()), (409, busy));
    page.send(r#"{"type":"open_scene","scene":"float"}"#);
    assert_eq!(page.wait("error")["text"], busy);
    open_gate.send(()).expect("it waits");
    assert_eq!(page.wait("error")["text"], "3 bytes of slow.msh");
    assert_eq!(record("c.msh").0, 202);
    assert_eq!(page.wait("error")["text"], "3 bytes of c.msh");
}
