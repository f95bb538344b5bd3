//! The header is what cbindgen makes of the crate. `make header` writes it: `GRASPFORCE_HEADER=write cargo test`.
#![allow(missing_docs, reason = "tests")]

use std::path::Path;

#[test]
fn the_header_is_current() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).expect("a configuration");
    let bindings = cbindgen::generate_with_config(folder, config).expect("sources that cbindgen can read");
    let mut generated = Vec::new();
    bindings.write(&mut generated);
    let header = folder.join("include/graspforce.h");
    if std::env::var("GRASPFORCE_HEADER").as_deref() == Ok("write") {
        std::fs::write(&header, &generated).expect("a folder that can be written");
    }
    let generated = String::from_utf8(generated).expect("a header in UTF-8");
    assert!(generated == std::fs::read_to_string(header).unwrap_or_default(), "run `make header`");
}
