//! The hosted link takes start-up code and `memcpy` from the C library.

fn main() {
    let os = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    if os != "none" {
        println!("cargo:rustc-link-lib=c");
    }
}
