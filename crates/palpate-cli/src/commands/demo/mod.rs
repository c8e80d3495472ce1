//! `palpate demo`: the paper's cube, held by two hands and shaken (figure 5b of the paper), then in the browser to be touched.

mod plot;

use crate::commands::inspect;
use crate::commands::run::{self, simulate};
use crate::commands::serve::{Serving, serve_built_in};
use crate::failure::Failure;
use crate::progress::Bars;
use crate::terminal::{notify, print};
use clap::Args;
use palpate::Recording;
use palpate_export::write_atomically;
use palpate_scene::{BUILT_IN_SCENES, RunMode, cache_folder, paper_cube_recipe, read_scene};
use plot::{Curve, plot};
use std::f64::consts::PI;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// Record an elastic cube, shake it, and touch it in the browser
///
/// Records the cube once (a few seconds; kept in the cache folder), runs a shake by two hands at 2 Hz, shows the forces, and
/// writes the scene, its paths, the steps as CSV and the deformed surfaces for ParaView. Then, on a terminal, it opens the
/// viewer with the built-in scenes, where you poke, squeeze and throw.
#[derive(Args)]
pub struct Arguments {
    /// Initial scene of the viewer: bounce, shake, pinch, stack, ball, slab, liver, jelly, gripper, duck, bar, fork, bell
    #[arg(value_name = "NAME", default_value = BUILT_IN_SCENES[0].id, value_parser = BUILT_IN_SCENES.map(|scene| scene.id))]
    name: String,
    /// Folder for what is written
    #[arg(short, long, default_value = "palpate-demo", value_name = "DIR")]
    output: PathBuf,
    /// Open the viewer also without a terminal
    #[arg(long)]
    serve: bool,
    /// End after the shake
    #[arg(long, conflicts_with = "serve")]
    no_serve: bool,
    /// Server options
    #[command(flatten)]
    serving: Serving,
}

/// Amplitude of the shake [m], its frequency [Hz], duration [s], and squeeze of each hand [m].
const AMPLITUDE_M: f64 = 0.01;
const FREQUENCY_HZ: f64 = 2.0;
const DURATION_S: f64 = 2.0;
const SQUEEZE_M: f64 = 0.003;

/// Runs the command.
pub fn demo(arguments: &Arguments) -> Result<(), Failure> {
    let person = std::io::stdout().is_terminal() && std::io::stdin().is_terminal();
    let serves = !arguments.no_serve && (arguments.serve || person);
    if arguments.serving.log.is_some() && !serves {
        return Err(Failure("--log is of the viewer, which is not opened here: add --serve".into()));
    }
    let output = &arguments.output;
    std::fs::create_dir_all(output).map_err(|e| Failure::file("make the folder", output, &e))?;
    let recording_path = output.join("cube.palp");
    let recording = cached_cube(12, 200, arguments.serving.cache.as_deref())?;
    let bytes = recording.to_bytes()?;
    write_atomically(&recording_path, &bytes)?;
    print("An elastic cube, 10 cm and 110 g, as soft as jelly:\n\n")?;
    inspect::print_as_text(&recording, &recording_path, bytes.len(), false)?;

    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        write_atomically(&output.join(format!("{name}.csv")), shake_path(side).as_bytes())?;
    }
    let scene_path = output.join("shake.toml");
    write_atomically(&scene_path, format!("{RULES}{TWO_HANDS}").as_bytes())?;
    let scene = read_scene(&scene_path, RunMode::Offline)?;
    let options = run::Arguments {
        strict: false,
        reference: false,
        scene: scene_path.clone(),
        duration: Some(DURATION_S),
        outputs: run::OutputArguments {
            csv: Some(output.join("shake.csv")),
            contacts: None,
            vtu: Some(output.join("vtu")),
            fps: 50.0,
            sound: None,
            sound_full_scale: 2.0,
            json: false,
        },
        realtime: run::RealtimeArguments::default(),
    };
    let summary = simulate(&scene, &options)?;
    print(&format!(
        "\nTwo hands hold the middles of its left and right face, press them {} mm together and shake it {} cm to \
         either side, {FREQUENCY_HZ} times a second, free of gravity:\n\n",
        2e3 * SQUEEZE_M,
        1e2 * AMPLITUDE_M
    ))?;
    let forces: Vec<Vec<f64>> =
        summary.forces.iter().map(|f| f.iter().map(|force| force.x).collect()).collect();
    let curves = [
        Curve { label: "force on the left hand, to the right", values: &forces[0] },
        Curve { label: "force on the right hand, to the right", values: &forces[1] },
    ];
    print(&plot(&curves, "N", DURATION_S))?;
    print("\n")?;
    print(&summary.text(&scene))?;
    print(&format!(
        "  steps        {}\n\nRun it again with other hands: edit {} and its paths, then\n  palpate run {} --csv shake.csv\n",
        output.join("shake.csv").display(),
        scene_path.display(),
        scene_path.display()
    ))?;
    if serves {
        print("\nNow touch one yourself: ")?;
        return serve_built_in(&arguments.serving, &arguments.name);
    }
    print("\nTouch one yourself, in the browser:\n  palpate serve\n")
}

/// Beginning of the scene.
const RULES: &str = r#"# The paper's figure 5(b): two hands hold a free cube and shake it at 2 Hz.
step = 0.001                       # s
gravity = [0.0, 0.0, 0.0]          # m/s²

"#;

/// A cube whose left and right face are held by two hands.
const TWO_HANDS: &str = include_str!("two_hands.toml");

/// Path of the hand on a side (−1 left, 1 right): squeeze within 0.2 s, then shake with a smooth start.
fn shake_path(side: f64) -> String {
    let smooth = |share: f64| 0.5 - 0.5 * (PI * share.clamp(0.0, 1.0)).cos();
    let mut text = String::from("t,x,y,z\n");
    for millisecond in 0..=(DURATION_S * 1000.0) as u32 {
        let t = f64::from(millisecond) / 1000.0;
        let squeeze = SQUEEZE_M * smooth(t / 0.2);
        let shake = AMPLITUDE_M * smooth((t - 0.2) / 0.3) * (2.0 * PI * FREQUENCY_HZ * (t - 0.2)).sin();
        text += &format!("{t},{},0,0\n", side * (0.05 - squeeze) + shake);
    }
    text
}

/// Recording of the paper's cube, from the cache or made and cached.
pub fn cached_cube(cells: u32, modes: usize, cache: Option<&Path>) -> Result<Recording, Failure> {
    let recipe = paper_cube_recipe(cells, modes);
    let folder = cache_folder(cache);
    if let Some(recording) = folder.as_deref().and_then(|folder| recipe.cached(folder)) {
        return Ok(recording);
    }
    notify(&format!(
        "recording the paper's cube, {cells}³ cells, {modes} modes (once; it is kept for the next time)"
    ));
    let mut progress = Bars::new();
    let recording = recipe.record(&mut progress)?;
    progress.finish();
    // Without a cache it is recorded again the next time.
    if folder.is_none_or(|folder| recipe.store(&recording, &folder).is_err()) {
        notify("warning: there is no folder to keep it in, so the cube will be recorded again");
    }
    Ok(recording)
}
