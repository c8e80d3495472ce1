//! Rebuilds the crate when the embedded page in `viewer/dist` changes; `cargo xtask viewer` builds it.

fn main() {
    println!("cargo:rerun-if-changed=../../viewer/dist");
}
