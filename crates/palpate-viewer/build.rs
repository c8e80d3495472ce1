//! The page is built by `cargo xtask viewer`, and embedded as it lies in `viewer/dist`.

fn main() {
    println!("cargo:rerun-if-changed=../../viewer/dist");
}
