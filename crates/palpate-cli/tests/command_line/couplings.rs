//! Which coupling is stable, as `inspect --device` says, and `coupling = "auto"` in scenes.

use crate::workplace::Workplace;

#[test]
fn inspect_tells_which_couplings_of_a_device_are_stable_and_the_later_the_fewer() {
    let workplace = Workplace::with_scene();
    let mut last = f64::INFINITY;
    for delay in ["0", "0.01", "0.05"] {
        let found =
            workplace.json(&["inspect", "cube.palp", "--device", "touch", "--delay", delay, "--json"]);
        let from = found["unstable_from_n_per_m"].as_f64().unwrap_or(1e9);
        let stiffness = found["default"]["stiffness_n_per_m"].as_f64().expect("a default");
        assert!(stiffness < from && from <= last, "{delay}: {found:#}");
        assert!(found["default"]["gain_margin"].as_f64() > Some(1.9), "{found:#}");
        last = from;
    }
    let text = workplace.succeed(&["inspect", "cube.palp", "--device", "omega.3", "--grip", "firm"]);
    for part in ["omega.3 at (", "hand: firm", "R[0]", "default      coupling = {", "by how much"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    for (arguments, expected) in [
        (&["--device", "phantom"][..], "device is \"phantom\", expected one of"),
        (&["--device", "touch", "--grip", "iron"], "grip is \"iron\", expected"),
        (&["--device", "touch", "--rate", "5"], "--rate is 5 Hz, expected 50 to 10000"),
        (&["--device", "touch", "--delay", "2"], "--delay is 2 s, expected 0 to 0.5"),
        (
            &["--device", "touch", "--point", "1,2"],
            "--point is \"1,2\", expected three numbers x,y,z in metres",
        ),
    ] {
        let error = workplace.fail(&[&["inspect", "cube.palp"], arguments].concat());
        assert!(error.starts_with(expected), "{error}");
    }
}

#[test]
fn an_automatic_coupling_is_chosen_and_said() {
    let workplace = Workplace::with_scene();
    let scene = workplace.text("scene.toml").replacen("path =", "coupling = \"auto\"\npath =", 1);
    workplace.write("auto.toml", &scene);
    let said = workplace.palpate(&["run", "auto.toml", "--duration", "0.02"]);
    let told = String::from_utf8_lossy(&said.stderr);
    assert!(said.status.success() && told.contains("left: coupling "), "{told}");
    workplace.write("wrong.toml", scene.replace("\"auto\"", "\"soft\""));
    let error = workplace.fail(&["run", "wrong.toml"]);
    assert!(
        error.contains("coupling is \"soft\", expected { stiffness = …, damping = … } or \"auto\""),
        "{error}"
    );
}
