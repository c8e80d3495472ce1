//! Rebuilds the crate when the embedded page changes: `page` is a link to `viewer/dist`, which `cargo xtask viewer` builds.

fn main() {
    println!("cargo:rerun-if-changed=page");
}
