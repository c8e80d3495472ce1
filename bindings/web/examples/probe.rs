//! probe
use std::sync::Arc;
fn main() {
    let d = "/tmp/wt1/";
    let mut parts = palpate_scene::PartsInMemory::default();
    parts.recordings.insert(
        "cube.palp".into(),
        Arc::new(palpate::Recording::from_bytes(&std::fs::read(format!("{d}cube.palp")).unwrap()).unwrap()),
    );
    for n in ["left.csv", "right.csv"] {
        parts.paths.insert(n.into(), std::fs::read_to_string(format!("{d}{n}")).unwrap());
    }
    let scene = palpate_scene::read_scene_text(
        std::path::Path::new("s"),
        &std::fs::read_to_string(format!("{d}press.toml")).unwrap(),
        &parts,
        palpate_scene::RunMode::Offline,
    )
    .unwrap();
    let mut sim = palpate_web::Simulation::new(Arc::new(scene));
    for k in 1..=2000 {
        let _ = sim.step();
        if k <= 400 {
            let mut h: u64 = 0;
            for a in
                [palpate_web::Array::Contacts, palpate_web::Array::Velocities, palpate_web::Array::Energies]
            {
                for v in sim.array(a) {
                    h = h.rotate_left(5) ^ v.to_bits();
                }
            }
            println!("H {k} {h}");
        }
        if k == 366 || k == 367 {
            for r in sim.array(palpate_web::Array::Contacts).chunks(14) {
                println!("C{k} {}", r.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(" "));
            }
        }
        if (365..=368).contains(&k) || k == 2000 {
            println!(
                "{k} {:?} {}",
                &sim.array(palpate_web::Array::Poses)[..3],
                sim.array(palpate_web::Array::Contacts).len() / 14
            );
        }
    }
}
