//! `palpate demo`: the paper's cube, held by two hands and shaken (figure 5b of the paper).

use crate::Failure;
use crate::plot::{Curve, plot};
use crate::progress::{Bars, WithoutRemarks};
use crate::scene_file::{self, Pace};
use crate::verbs::run::{self, simulate};
use crate::verbs::{inspect, print, read_recording, write_whole};
use clap::Args;
use palpate::{Damping, Material, Recording};
use palpate_fem::element::Order;
use palpate_fem::mesh::box_mesh;
use palpate_fem::record::{Extent, RecordParameters, record};
use palpate_fem::residual::ResidualChoice;
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

/// The main job in one command: an elastic cube, held by two hands and shaken at 2 Hz
///
/// Records the cube once (a few seconds; kept in the cache folder), runs the shake, shows the forces, and writes
/// the scene, its paths, the steps as CSV and the deformed surfaces for ParaView.
#[derive(Args)]
pub struct Arguments {
    /// Folder for what is written
    #[arg(short, long, default_value = "palpate-demo", value_name = "DIR")]
    output: PathBuf,
    /// Where recordings are kept between runs [default: $XDG_CACHE_HOME/palpate or ~/.cache/palpate]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
}

/// Half the way of the hands [m], how often [Hz], how long [s], and how much they squeeze [m].
const AMPLITUDE_M: f64 = 0.01;
const FREQUENCY_HZ: f64 = 2.0;
const DURATION_S: f64 = 2.0;
const SQUEEZE_M: f64 = 0.003;

/// The paper's material (section 3.1), with the damping of the reference series in `data/reference`.
pub fn paper_cube(cells: u32, modes: usize) -> RecordParameters {
    RecordParameters {
        materials: vec![Material {
            region: String::new(),
            young_pa: 2000.0,
            poisson: 0.49,
            density_kg_m3: 110.0,
        }],
        order: Order::Linear,
        modes,
        damping: Damping::Rayleigh { alpha: 2.0, beta: 2e-4 },
        residual: ResidualChoice::Automatic,
        fixed_nodes: Vec::new(),
        source: format!("box:0.1x0.1x0.1/{cells}x{cells}x{cells}"),
        extent: Extent::Whole,
    }
}

/// Run the verb.
pub fn demo(arguments: &Arguments) -> Result<(), Failure> {
    let output = &arguments.output;
    std::fs::create_dir_all(output).map_err(|e| Failure::file("make the folder", output, &e))?;
    let recording_path = output.join("cube.palp");
    let recording = cached_cube(12, 200, arguments.cache.as_deref())?;
    let bytes = recording.to_bytes()?;
    write_whole(&recording_path, &bytes)?;
    print("An elastic cube, 10 cm and 110 g, as soft as jelly:\n\n")?;
    inspect::print_for_person(&recording, &recording_path, bytes.len())?;

    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        write_whole(&output.join(format!("{name}.csv")), shake_path(side).as_bytes())?;
    }
    let scene_path = output.join("shake.toml");
    write_whole(&scene_path, SCENE.as_bytes())?;
    let scene = scene_file::read(&scene_path, Pace::Offline)?;
    let options = run::Arguments {
        scene: scene_path.clone(),
        duration: Some(DURATION_S),
        outputs: run::OutputArguments {
            csv: Some(output.join("shake.csv")),
            contacts: None,
            vtu: Some(output.join("vtu")),
            fps: 50.0,
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
    ))
}

const SCENE: &str = r#"# The paper's figure 5(b): two hands hold a free cube and shake it at 2 Hz.
step = 0.001                       # s
gravity = [0.0, 0.0, 0.0]          # m/s²

[[object]]
name = "cube"
recording = "cube.palp"

[[device]]
name = "left"
mode = "held"
attach = { object = "cube", point = [-0.05, 0.0, 0.0] }
path = { file = "left.csv" }

[[device]]
name = "right"
mode = "held"
attach = { object = "cube", point = [0.05, 0.0, 0.0] }
path = { file = "right.csv" }
"#;

/// Path of the hand on one side (−1 left, 1 right): squeeze within 0.2 s, shake with a soft start.
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

/// The paper's cube from the cache, or recorded into it.
pub fn cached_cube(cells: u32, modes: usize, cache: Option<&Path>) -> Result<Recording, Failure> {
    let folder = cache.map(Path::to_path_buf).or_else(cache_folder);
    let name = format!("cube-{cells}-{modes}-{}.palp", env!("CARGO_PKG_VERSION"));
    let path = folder.as_ref().map(|folder| folder.join(name));
    if let Some(recording) = path.as_deref().and_then(|path| read_recording(path).ok()) {
        return Ok(recording);
    }
    crate::tell(&format!(
        "recording the paper's cube, {cells}³ cells, {modes} modes (once; it is kept for the next time)"
    ));
    let mut progress = Bars::new();
    let mesh = box_mesh([0.1; 3], [cells; 3])?;
    let recording = record(mesh, &paper_cube(cells, modes), &mut WithoutRemarks(&mut progress))?.recording;
    progress.finish();
    // A cache that can't be written costs time the next time, nothing else.
    if let (Some(folder), Some(path)) = (folder, path)
        && std::fs::create_dir_all(&folder).is_ok()
        && write_whole(&path, &recording.to_bytes()?).is_err()
    {
        crate::tell(&format!(
            "warning: {} cannot be written, so the cube will be recorded again",
            path.display()
        ));
    }
    Ok(recording)
}

fn cache_folder() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    Some(folder("XDG_CACHE_HOME").or_else(|| Some(folder("HOME")?.join(".cache")))?.join("palpate"))
}
