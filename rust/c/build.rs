//! The name by which programs find the shared library at run time: binary compatible versions share it.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        let version = |part| std::env::var(format!("CARGO_PKG_VERSION_{part}")).unwrap_or_default();
        println!(
            "cargo::rustc-cdylib-link-arg=-Wl,-soname,libgraspforce.so.{}.{}",
            version("MAJOR"),
            version("MINOR")
        );
    }
}
