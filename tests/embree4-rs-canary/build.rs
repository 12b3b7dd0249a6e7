//! `embree4-sys` asks for `-lembree4` and says nowhere where that is.

fn main() {
    println!("cargo::rerun-if-env-changed=EMBREE_DIR");
    if let Ok(prefix) = std::env::var("EMBREE_DIR") {
        println!("cargo::rustc-link-search=native={prefix}/lib");
        println!("cargo::rustc-link-arg=-Wl,-rpath,{prefix}/lib");
    }
}
