//! Records a ball of silicone in code and presses a fingertip into it: depth and force.
//!
//! `cargo run --release -p palpate-scene --example record_and_touch [OUT.palp]` also writes the recording, for scenes.

use palpate::glam::DVec3;
use palpate::{
    Damping, DeviceInput, DeviceParameters, Input, Model, ModelObject, ModelParameters, ObjectStart, Pose,
    Recording, State, Twist, step,
};
use palpate_scene::{BodySource, MaterialChoice, ProgressFn, RecordOptions};
use std::error::Error;
use std::sync::Arc;

/// Radius of the ball, and of the fingertip [m].
const BALL_M: f64 = 0.04;
const TIP_M: f64 = 0.008;

/// Records the ball, fixed at its lower part; stages go to standard error.
fn record() -> Result<Recording, Box<dyn Error>> {
    let options = RecordOptions {
        materials: MaterialChoice::Named(vec!["ecoflex-00-30".into()]),
        damping: Some(Damping::Rayleigh { alpha: 0.0, beta: 2e-3 }),
        modes: 40,
        fix: vec!["z<-0.03".into()],
        ..RecordOptions::default()
    };
    let mut progress = ProgressFn::new(|stage: &str, share: Option<f64>| {
        if share.unwrap_or(0.0) == 0.0 {
            eprintln!("{stage} …");
        }
    });
    // A file name does as well: a mesh, or a closed surface as STL or OBJ.
    Ok(options.record(BodySource::Text("sphere:0.04/3"), &mut progress)?)
}

/// Presses the ball from above, 10 µm per step of 1 ms; gives a line per half millimetre.
fn press(ball: Arc<Recording>) -> Result<Vec<String>, Box<dyn Error>> {
    let tip = DeviceParameters { tip_radius: TIP_M, patch_radius: TIP_M, ..DeviceParameters::default() };
    let parameters = ModelParameters { devices: vec![tip], ..ModelParameters::default() };
    let centre = DVec3::from(ball.metadata.mass.center_of_mass_m);
    let start = ObjectStart { pose: Pose { position: centre, ..Pose::IDENTITY }, twist: Twist::ZERO };
    let model = Model::new(parameters, vec![ModelObject::new(ball, start)])?;
    let mut state = State::new(&model);
    let mut lines = vec!["depth [mm]   force [N]   contacts".to_string()];
    for number in 0..=400_u32 {
        // Still for half of the time, so that the force is that of rest.
        let depth = 1e-5 * f64::from(number.min(200));
        let hand = DVec3::Z * (BALL_M + TIP_M - depth);
        let input = Input { devices: vec![DeviceInput::touching(hand)], ..Input::default() };
        let output = step(&model, &mut state, &input);
        if number % 50 == 0 {
            let force = output.devices[0].force_on_hand.z;
            lines.push(format!("{:10.2}   {force:9.4}   {:8}", 1e3 * depth, output.contacts.len()));
        }
    }
    Ok(lines)
}

fn main() -> Result<(), Box<dyn Error>> {
    let ball = record()?;
    if let Some(path) = std::env::args_os().nth(1) {
        std::fs::write(path, ball.to_bytes()?)?;
    }
    println!("ball of {:.3} kg, {} modes", ball.mass(), ball.modes.len());
    for line in press(Arc::new(ball))? {
        println!("{line}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_force_grows_with_the_depth_and_stays_at_rest() {
        let ball = Arc::new(record().expect("a recording"));
        let lines = press(ball).expect("a press");
        let numbers = |line: &String| line.split_whitespace().map(|n| n.parse().expect("a number")).collect();
        let rows: Vec<Vec<f64>> = lines[1..].iter().map(numbers).collect();
        assert_eq!(rows.len(), 9);
        assert!(rows[1..5].windows(2).all(|pair| pair[0][1] < pair[1][1]), "{rows:?}");
        assert!(rows[4][1] > 0.1 && (rows[8][1] / rows[7][1] - 1.0).abs() < 0.01, "{rows:?}");
    }
}
