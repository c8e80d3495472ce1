//! Arguments of the linker on macOS, where Python's symbols have to be declared as missing.

fn main() {
    pyo3_build_config::add_extension_module_link_args();
}
