//! Options of `palpate record` beside the mesh: materials by name, supports, curved elements, dry runs.

use crate::workplace::Workplace;
use serde_json::Value;

#[test]
fn named_materials_are_listed_and_recorded() {
    let workplace = Workplace::new();
    let list = workplace.json(&["materials", "--json"]);
    let names: Vec<_> = list["materials"].as_array().into_iter().flatten().map(|one| &one["name"]).collect();
    assert_eq!(names.len(), 11);
    let text = workplace.succeed(&["materials"]);
    assert!(names.iter().all(|name| text.contains(name.as_str().unwrap_or("?"))), "{text}");
    let small = ["record", "box:0.1x0.1x0.1/2x2x2", "--modes", "6", "-o", "a.palp", "--material"];
    let text = workplace.succeed(&[&small[..], &["paper"]].concat());
    assert!(text.contains("E = 2000 Pa, ν = 0.49, ρ = 110 kg/m³") && text.contains("α"), "{text}");
    let wood = workplace.succeed(&[&small[..], &["wood"]].concat());
    assert!(wood.contains("anisotropic, means E = ") && wood.contains("ρ = 450 kg/m³"), "{wood}");
    assert!(
        workplace
            .fail(&[&small[..], &["cheese"]].concat())
            .contains("--material: there is no material \"cheese\"")
    );
}

#[test]
fn supports_are_held_and_a_body_that_is_loose_is_refused() {
    let workplace = Workplace::new();
    let bar = ["record", "box:0.2x0.05x0.05/4x1x1", "--material", "rubber", "--modes", "6", "-o", "a.palp"];
    let held = ["--fix", "x: x<-0.099", "--spring", "1e6: z<-0.024", "--json"];
    let found = workplace.json(&[&bar[..], &held].concat());
    // The low end with 9 nodes, and the bottom with 27, of which 3 are on both.
    assert_eq!((&found["support"], &found["fixed_nodes"]), (&Value::from("fixed"), &Value::from(33)));
    let loose = workplace.fail(&[&bar[..], &["--fix", "x: x<-0.099"]].concat());
    assert!(loose.contains("the supports leave the body free to move or to turn as a whole"), "{loose}");
    let spring = workplace.fail(&[&bar[..], &["--spring", "z<-0.024"]].concat());
    assert!(spring.contains("expected 'STIFFNESS: NODES'"), "{spring}");
}

#[test]
fn a_dry_run_says_what_the_recording_takes_and_records_nothing() {
    let workplace = Workplace::new();
    let ball = ["record", "sphere:0.05/3", "--material", "foam", "--modes", "40"];
    let said = workplace.json(&[&ball[..], &["--dry-run", "--json"]].concat());
    let text = workplace.succeed(&[&ball[..], &["--dry-run", "-o", "a.palp"]].concat());
    assert!(text.starts_with("sphere:0.05/3: nothing is recorded (--dry-run)\n"), "{text}");
    assert!(!workplace.path("a.palp").exists());
    // Where the recording would go to standard output, the estimate is there alone.
    let piped = workplace.json(&[&ball[..], &["--dry-run", "--json", "-o", "-"]].concat());
    assert_eq!(piped["file_bytes"], said["file_bytes"]);
    assert_eq!(
        workplace.succeed(&[&ball[..], &["--dry-run", "-o", "-"]].concat()).lines().count(),
        text.lines().count()
    );
    let recorded = workplace.json(&[&ball[..], &["-o", "a.palp", "--json"]].concat());
    assert_eq!(said["nodes"], recorded["nodes"]);
    let bytes = std::fs::metadata(workplace.path("a.palp")).expect("a recording").len() as f64;
    let file = said["file_bytes"].as_f64().unwrap_or_default();
    // How well a compact file compresses depends on the body.
    assert!((file / bytes - 1.0).abs() < 0.3, "{file} {bytes}");
    // With curved edges the ball is lighter by less than 0.5 %: straight ones cut off 8 %.
    let exact = 30.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.05_f64.powi(3);
    let mass = recorded["mass_kg"].as_f64().unwrap_or_default();
    assert!((mass / exact - 1.0).abs() < 5e-3, "{mass} {exact}");
}
