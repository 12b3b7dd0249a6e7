//! The command line through the real binary: what is written, what is said, and where.

use std::fs;

use crate::place::{Place, stderr, stdout};
use octolux::film::read_picture;
use octolux::lane::AVX512;
use octolux::settings::EstimatorKind;

#[test]
fn a_render_leaves_an_exr_and_a_png_named_after_the_scene() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml");
    assert_eq!(place.files(), ["small.exr", "small.png"]);
    let picture = read_picture(&place.path().join("small.exr")).unwrap();
    assert!(picture.width > 0 && picture.pixels.len() == picture.width as usize * picture.height as usize);
    assert!(output.stdout.is_empty(), "standard output carries data only");
    let said = stderr(&output);
    assert!(said.contains("wrote small.exr, small.png"), "{said}");
    assert!(!said.contains('\x1b'), "no colours and no bar into a pipe: {said:?}");
}

#[test]
fn outputs_have_the_size_and_the_formats_that_were_asked_for() {
    let place = Place::new();
    place.succeeds("render in/small.toml --spp 2 --size 20x10 -o a.exr -o b.npy --output c.PNG");
    assert_eq!(place.files(), ["a.exr", "b.npy", "c.PNG"]);
    let (a, b) = (
        read_picture(&place.path().join("a.exr")).unwrap(),
        read_picture(&place.path().join("b.npy")).unwrap(),
    );
    assert_eq!((a.width, a.height), (20, 10));
    assert_eq!(a, b);
}

#[test]
fn snapshots_are_written_after_powers_of_two() {
    let place = Place::new();
    place.succeeds("render in/small.toml --spp 5 --snapshots -o a.png -o a.npy");
    let expected = [
        "a.npy",
        "a.png",
        "a_0001spp.npy",
        "a_0001spp.png",
        "a_0002spp.npy",
        "a_0002spp.png",
    ];
    let files = place.files();
    assert_eq!(files[..6], expected);
    assert_eq!(files[6..], ["a_0004spp.npy", "a_0004spp.png"]);
}

#[test]
fn the_statistics_have_every_key() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml --spp 4 --seed 7 --threads 2 --lanes 8 --stats s.json --json");
    let line = stdout(&output);
    assert_eq!(line.lines().count(), 1, "one line a scene");
    let printed: serde_json::Value = serde_json::from_str(&line).unwrap();
    let written: serde_json::Value = serde_json::from_slice(&fs::read(place.path().join("s.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    let keys = "scene width height spp estimator estimator_why sampler seed lanes threads target_features embree_version commit load_s \
                build_s render_s write_s samples eye_rays shadow_rays samples_per_s rays_per_s invalid_samples kernel \
                needs cpu first_pass_s peak_rss_bytes octolux_version interrupted adaptive spp_min spp_mean spp_max robust cull \
                rays_together replicates target_error target_reached error";
    for key in keys.split_whitespace() {
        assert!(printed.get(key).is_some(), "{key}");
    }
    assert_eq!((&printed["spp"], &printed["seed"]), (&4.into(), &7.into()));
    assert_eq!(printed["scene"], "in/small.toml");
    assert_eq!(printed["estimator"], "product");
    assert_eq!(printed["estimator_why"], "least error for its time");
    for cause in ["nan", "inf", "negative"] {
        assert_eq!(printed["invalid_samples"][cause], 0);
    }
}

#[test]
fn an_exr_says_how_it_was_made() {
    use exr::prelude::*;
    let place = Place::new();
    place.succeeds("render in/small.toml --spp 4 --seed 9 --estimator brdf --sampler independent -o a.exr");
    let meta = MetaData::read_from_file(place.path().join("a.exr"), true).unwrap();
    let get = |name: &str| meta.headers[0].own_attributes.other.get(&Text::from(name)).cloned();
    assert_eq!(get("octolux.spp"), Some(AttributeValue::I32(4)));
    assert_eq!(get("octolux.seed"), Some(AttributeValue::I32(9)));
    assert_eq!(get("octolux.estimator"), Some(AttributeValue::Text("brdf".into())));
    assert_eq!(get("octolux.sampler"), Some(AttributeValue::Text("independent".into())));
    assert_eq!(get("octolux.scene"), Some(AttributeValue::Text("in/small.toml".into())));
    for name in [
        "lanes",
        "kernel",
        "robust",
        "cull",
        "version",
        "commit",
        "embree_version",
        "target_features",
    ] {
        assert!(get(&format!("octolux.{name}")).is_some(), "{name}");
    }
}

#[test]
fn quiet_says_nothing() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml --quiet");
    assert_eq!((stdout(&output), stderr(&output)), (String::new(), String::new()));
}

#[test]
fn a_time_limit_renders_at_least_one_pass() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml --time 0.000001 --json");
    let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(stats["spp"].as_u64() >= Some(1), "{stats}");
}

#[test]
fn an_adaptive_render_tells_where_its_samples_went() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml --adaptive --spp 32 --json -o a.exr");
    let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(stats["adaptive"], true);
    assert_eq!((&stats["spp"], &stats["spp_mean"]), (&32.into(), &32.0.into()));
    assert_eq!(stats["samples"], 8 * 6 * 32);
    assert!(
        stats["spp_min"].as_u64() >= Some(8) && stats["spp_max"].as_u64() > Some(32),
        "{stats}"
    );
    let image = exr::prelude::read_first_flat_layer_from_file(place.path().join("a.exr")).unwrap();
    let samples = &image.layer_data.channel_data.list[3];
    assert_eq!(samples.name.to_string(), "samples.N");
    let most = samples.sample_data.values_as_f32().fold(0.0, f32::max);
    assert_eq!(Some(most as u64), stats["spp_max"].as_u64());
}

#[test]
fn an_adaptive_render_has_a_number_of_samples_not_a_time() {
    let place = Place::new();
    for option in ["--time 1", "--snapshots"] {
        let output = place.octolux(&format!("render in/small.toml --adaptive {option}"));
        assert_eq!(output.status.code(), Some(2));
        let said = stderr(&output);
        assert!(said.contains("cannot be used with"), "{said}");
    }
    assert!(place.files().is_empty());
}

#[test]
fn explain_tells_the_counts_and_the_plan() {
    let place = Place::new();
    let text = stdout(&place.succeeds("explain in/small.toml"));
    for word in ["spheres", "materials", "needs", "kernel", "because", " rays a packet"] {
        assert!(text.contains(word), "{text}");
    }
    let json = place.succeeds("explain in/small.toml --json --lanes 1 --size 5x4");
    let object: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!((&object["lanes"], &object["width"]), (&1.into(), &5.into()));
    assert!(place.files().is_empty(), "explain writes no file");
}

#[test]
fn whether_embree_is_robust_is_told_and_where_it_says_nothing() {
    let place = Place::new();
    for (arguments, robust, noted) in [
        ("--accel embree", Some(true), false),
        ("--accel embree --robust on", Some(true), false),
        ("--accel embree --robust off", Some(false), false),
        ("--accel linear", None, false),
        ("--robust off", None, true),
    ] {
        let output = place.succeeds(&format!("render in/small.toml --json -o a.npy {arguments}"));
        let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(stats["robust"], serde_json::json!(robust), "{arguments}");
        let said = stderr(&output);
        assert_eq!(
            said.contains("--robust off changes nothing"),
            noted,
            "{arguments}: {said}"
        );
        let explained = stdout(&place.succeeds(&format!("explain in/small.toml {arguments}")));
        let words = robust.map_or("without effect", |on| if on { "on: " } else { "off: " });
        assert!(explained.contains(&format!("  robust     {words}")), "{explained}");
    }
    place.refused("render in/small.toml --robust maybe");
}

#[test]
fn whether_shapes_are_culled_is_told_and_changes_no_figure() {
    let place = Place::new();
    let stats = |arguments: &str| -> serde_json::Value {
        let output = place.succeeds(&format!("render in/small.toml --json -o a.npy {arguments}"));
        serde_json::from_slice(&output.stdout).unwrap()
    };
    for accel in ["linear", "embree"] {
        let on = stats(&format!("--accel {accel}"));
        let off = stats(&format!("--accel {accel} --cull off"));
        assert_eq!((&on["cull"], &off["cull"]), (&true.into(), &false.into()), "{accel}");
        for key in ["samples", "eye_rays", "shadow_rays"] {
            assert_eq!(on[key], off[key], "{accel}: {key}");
        }
        let explained = stdout(&place.succeeds(&format!("explain in/small.toml --accel {accel} --cull off")));
        assert!(explained.contains("  cull       off: "), "{explained}");
    }
    place.refused("render in/small.toml --cull maybe");
}

#[test]
fn without_avx512_eight_lanes_have_the_same_bits() {
    let place = Place::new();
    let there = is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    let with = |value: &str, arguments: &str| place.command(arguments).env(AVX512, value).output().unwrap();
    // Shapes of all kinds, lights of all kinds, both models of reflection; a mesh for packets of neighbours.
    let scenes = ["veach-mis", "still-life", "mesh-light", "knot"].map(|name| {
        let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
        format!("{scenes}/{name}.toml")
    });
    for scene in scenes {
        for estimator in EstimatorKind::ALL.map(EstimatorKind::name) {
            let arguments = format!("render {scene} --estimator {estimator} --size 40x30 --spp 6 --lanes 8 --json -o");
            let pictures = ["on", "off"].map(|value| {
                let output = with(value, &format!("{arguments} {value}.npy"));
                assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
                let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
                let kernel = stats["kernel"].as_str().unwrap().to_owned();
                assert_eq!(kernel.contains("avx512"), value == "on" && there, "{value}: {kernel}");
                std::fs::read(place.path().join(value).with_extension("npy")).unwrap()
            });
            assert!(pictures[0] == pictures[1], "{scene}, {estimator}: pictures differ");
        }
    }
    let sixteen = with("off", "render in/small.toml --lanes 16");
    assert_eq!(sixteen.status.code(), Some(2), "{}", stderr(&sixteen));
    let refused = with("maybe", "render in/small.toml");
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains(AVX512), "{}", stderr(&refused));
}

#[test]
fn a_picture_that_rests_on_few_samples_is_said_to() {
    let place = Place::new();
    for (arguments, speckled) in [
        ("--estimator brdf --spp 16", true),
        ("--estimator brdf --spp 2048", false),
        ("--estimator light --spp 16", false),
        ("--estimator mis --spp 16", false),
    ] {
        let output = place.succeeds(&format!(
            "render in/small.toml --size 48x48 --json -o a.npy {arguments}"
        ));
        let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let light = stats["outliers"]["light"].as_f64().unwrap();
        assert_eq!(light > 0.5, arguments.contains("brdf"), "{arguments}: {stats}");
        assert_eq!(
            stderr(&output).contains("has fireflies: 1 of "),
            speckled,
            "{arguments}: {stats}"
        );
    }
    for arguments in ["--spp 1", "--target-error 0.5"] {
        let output = place.succeeds(&format!("render in/small.toml --json -o a.npy {arguments}"));
        let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(stats["outliers"].is_null(), "{arguments}: {stats}");
    }
}

#[test]
fn help_and_version_go_to_standard_output() {
    let place = Place::new();
    assert!(stdout(&place.succeeds("--version")).starts_with("octolux 0."));
    assert!(stdout(&place.succeeds("--help")).contains("Examples:"));
    let help = stdout(&place.succeeds("render --help"));
    for word in ["Examples:", "--snapshots", "1|8|16", "0001spp", "{name}"] {
        assert!(help.contains(word), "{word}: {help}");
    }
}
