//! Scenes whose shapes are tiny, huge, far or in one place, as a hunt for wrong pictures left them, through the real binary. The truth
//! is the same scene at an ordinary size, a closed form, or the oracle.

use std::fs;

use octolux::film::read_picture;

use crate::place::{Place, stderr};

const BLOCKS: &[u8] = include_bytes!("../coincidences/blocks.png");

/// The picture of a scene, and what was said.
fn render(text: &str, options: &str) -> (Vec<[f32; 3]>, String) {
    let place = Place::new();
    fs::write(place.path().join("s.toml"), text).unwrap();
    fs::write(place.path().join("blocks.png"), BLOCKS).unwrap();
    let output = place.succeeds(&format!("render s.toml -o o.npy {options}"));
    let picture = read_picture(&place.path().join("o.npy")).unwrap();
    (picture.pixels, stderr(&output))
}

fn pixels(text: &str, options: &str) -> Vec<[f32; 3]> {
    render(text, options).0
}

fn mean(pixels: &[[f32; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|k| pixels.iter().map(|p| f64::from(p[k])).sum::<f64>() / pixels.len() as f64)
}

/// The mean of the oracle, with its standard error.
fn oracle(text: &str, spp: u32) -> [f64; 3] {
    let place = Place::new();
    fs::write(place.path().join("s.toml"), text).unwrap();
    fs::write(place.path().join("blocks.png"), BLOCKS).unwrap();
    place.succeeds(&format!("reference s.toml -o o.npy --spp {spp}"));
    mean(&read_picture(&place.path().join("o.npy")).unwrap().pixels)
}

fn differ(a: &[[f32; 3]], b: &[[f32; 3]]) -> usize {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .filter(|(a, b)| a.map(f32::to_bits) != b.map(f32::to_bits))
        .count()
}

const FILM: &str = "[film]\nwidth = 16\nheight = 16\n";

/// A textured square and a smooth body beside each other, all lengths times `scale`.
fn fine(scale: f64) -> String {
    let s = |x: f64| format!("{:e}", x * scale);
    let v = |x: f64, y: f64, z: f64| format!("[{}, {}, {}]", s(x), s(y), s(z));
    format!(
        "[camera]\norigin = {}\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 40\n{FILM}\
         [materials.t]\ndiffuse = [1, 1, 1]\ntexture = \"blocks.png\"\n[materials.p]\nphong = [0.8, 0.7, 0.6]\nexponent = 20\n\
         [[meshes]]\nmaterial = \"t\"\nvertices = [{}, {}, {}, {}]\nuvs = [[0, 0], [1, 0], [1, 1], [0, 1]]\nfaces = [[0, 1, 2, 3]]\n\
         [[meshes]]\nmaterial = \"p\"\nnormals = \"smooth\"\nvertices = [{}, {}, {}, {}, {}, {}]\n\
         faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]]\n\
         [[spheres]]\ncenter = {}\nradius = {}\nemission = [30, 30, 30]\n[environment]\nemission = [0.1, 0.1, 0.1]\n",
        v(0.3, 0.2, 1.0),
        v(-0.4, -0.3, 0.0),
        v(0.4, -0.3, 0.0),
        v(0.4, 0.3, 0.0),
        v(-0.4, 0.3, 0.0),
        v(0.1, 0.0, 0.1),
        v(0.0, 0.0, 0.2),
        v(-0.1, 0.0, 0.1),
        v(0.0, 0.0, 0.0),
        v(0.0, 0.1, 0.1),
        v(0.0, -0.1, 0.1),
        v(0.5, 0.9, 0.8),
        s(0.1)
    )
}

/// Embree sets barycentric coordinates to 0 where edges are below 1e-9: textures and smooth normals were those of one corner.
#[test]
fn textures_and_smooth_normals_do_not_depend_on_the_unit_of_length() {
    for accel in ["embree", "linear"] {
        let options = format!("--accel {accel} --spp 4");
        let base = pixels(&fine(1.0), &options);
        for exponent in [-60, -34, -30, -24, 24, 30, 60] {
            let other = pixels(&fine(2.0_f64.powi(exponent)), &options);
            assert_eq!(differ(&base, &other), 0, "{accel}, 2^{exponent}");
        }
    }
}

/// A fine mesh in a large scene: a far sphere changes nothing in front of a square of 1e-9 but what it hides, which is nothing.
#[test]
fn fine_meshes_keep_their_textures_in_large_scenes() {
    let far =
        "[[spheres]]\ncenter = [0, 0, 1e5]\nradius = 1\nmaterial = \"t0\"\n[materials.t0]\ndiffuse = [0.5, 0.5, 0.5]\n";
    let small = fine(2.0_f64.powi(-30));
    let (alone, with_far) = (
        pixels(&small, "--accel embree --spp 4"),
        pixels(&format!("{small}{far}"), "--accel embree --spp 4"),
    );
    assert_eq!(differ(&alone, &with_far), 0);
}

const ROOM: &str = "[camera]\norigin = [0.3, 2, 4]\ntarget = [0, 0.3, 0]\nup = [0, 1, 0]\nfov_x = 40\n[film]\nwidth = 16\nheight = 16\n\
    [materials.a]\ndiffuse = [0.8, 0.2, 0.2]\n[materials.b]\ndiffuse = [0.2, 0.2, 0.8]\n\
    [materials.a1]\ndiffuse = [0.8, 0.2, 0.2]\none_sided = true\n[materials.b1]\ndiffuse = [0.2, 0.2, 0.8]\none_sided = true\n\
    [materials.t]\ndiffuse = [1, 1, 1]\ntexture = \"blocks.png\"\nwrap = \"repeat\"\n\
    [materials.p]\nphong = [0.5, 0.6, 0.7]\nexponent = 40\n";

const LAMP: &str = "[[spheres]]\ncenter = [1, 3, 1]\nradius = 0.5\nemission = [20, 20, 20]\n";

fn floor(material: &str, more: &str) -> String {
    format!(
        "[[meshes]]\nmaterial = \"{material}\"\nvertices = [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]\n\
         faces = [[0, 1, 2, 3]]\n{more}"
    )
}

/// Whole numbers of texture coordinates are no part of the picture: before, at 1e7, it was off by 108 %.
#[test]
fn repeated_textures_are_the_same_far_out() {
    let at = |u: f64| {
        let uvs = format!(
            "uvs = [[{u}, {u}], [{}, {u}], [{}, {}], [{u}, {}]]\n",
            u + 6.0,
            u + 6.0,
            u + 6.0,
            u + 6.0
        );
        pixels(&format!("{ROOM}{LAMP}{}", floor("t", &uvs)), "--spp 4")
    };
    let base = at(0.0);
    for u in [1.0, 1e6, 1e7, 1e9] {
        assert_eq!(differ(&base, &at(u)), 0, "{u}");
    }
}

const WIDTHS: [&str; 4] = [
    "--accel embree --lanes 1",
    "--accel embree --lanes 8",
    "--accel linear --lanes 1",
    "--accel linear --lanes 8",
];

/// Two meshes meet at an edge of 28 000 units: single rays and packets named different ones for 14 of 256 pixels.
#[test]
fn an_edge_between_meshes_is_seen_alike_by_all_widths() {
    let half = |material: &str, face: &str| {
        format!(
            "[[meshes]]\nmaterial = \"{material}\"\nvertices = [[-1e4, 0, 1e4], [1e4, 0, 1e4], [1e4, 0, -1e4], [-1e4, 0, -1e4]]\n\
             faces = [{face}]\n"
        )
    };
    let text = format!("{ROOM}{LAMP}{}{}", half("a", "[0, 1, 2]"), half("b", "[0, 2, 3]"));
    let all = WIDTHS.map(|options| pixels(&text, &format!("{options} --spp 4")));
    assert_eq!(differ(&all[0], &all[1]), 0, "Embree, 1 and 8 lanes");
    assert_eq!(differ(&all[2], &all[3]), 0, "in a line, 1 and 8 lanes");
    // Both ask in f64 whom a ray meets next to an edge: no pixel changes its colour.
    let worst = all[0]
        .iter()
        .zip(&all[2])
        .flat_map(|(a, b)| (0..3).map(move |k| (a[k] / b[k] - 1.0).abs()));
    assert!(worst.fold(0.0, f32::max) < 1e-3);
}

/// Of floors in one place the first in the file is seen, by packets, single rays, the line and the oracle.
#[test]
fn of_coincident_floors_the_first_is_seen() {
    // The same corners; another diagonal; a part of it; the same, wound the other way.
    let second = |vertices: &str, faces: &str| {
        format!("[[meshes]]\nmaterial = \"b\"\nvertices = {vertices}\nfaces = [{faces}]\n")
    };
    let whole = "[[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]";
    let cases = [
        (second(whole, "[0, 1, 2, 3]"), "lie exactly on earlier ones"),
        (second(whole, "[0, 1, 3], [1, 2, 3]"), "lie in one plane"),
        (
            second("[[-3, 0, 2], [2, 0, 2], [2, 0, -3]]", "[0, 1, 2]"),
            "lie in one plane",
        ),
    ];
    let alone = format!("{ROOM}{LAMP}{}", floor("a", ""));
    for (other, said) in cases {
        let text = format!("{alone}{other}");
        for options in WIDTHS {
            let (picture, notes) = render(&text, &format!("{options} --spp 4"));
            assert!(notes.contains(said), "{options}: {notes}");
            let [red, _, blue] = mean(&picture);
            assert!((red / blue - 4.0).abs() < 1e-3, "{options}, {other}: {red} {blue}");
            let same = pixels(&alone, &format!("{options} --spp 4"));
            let worst = picture.iter().zip(&same).map(|(a, b)| (a[0] / b[0] - 1.0).abs());
            assert!(worst.fold(0.0, f32::max) < 1e-3, "{options}, {other}");
        }
        let [red, _, blue] = oracle(&text, 4);
        assert!((red / blue - 4.0).abs() < 1e-6, "the oracle, {other}: {red} {blue}");
    }
}

/// Of two sheets back to back the one that looks at the ray is seen: red from above, whatever the order.
#[test]
fn back_to_back_the_side_that_looks_at_the_ray_is_seen() {
    let sheet = |material: &str, faces: &str| {
        format!(
            "[[meshes]]\nmaterial = \"{material}\"\nvertices = [[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]\nfaces = [{faces}]\n"
        )
    };
    let (up, down) = ("[0, 1, 2, 3]", "[0, 3, 2, 1]");
    for (first, second) in [
        (sheet("a1", up), sheet("b1", down)),
        (sheet("b1", down), sheet("a1", up)),
    ] {
        let text = format!("{ROOM}{LAMP}{first}{second}");
        for options in WIDTHS {
            let [red, _, blue] = mean(&pixels(&text, &format!("{options} --spp 4")));
            assert!(red > 0.1 && (red / blue - 4.0).abs() < 1e-3, "{options}: {red} {blue}");
        }
        let [red, _, blue] = oracle(&text, 4);
        assert!(red > 0.1 && (red / blue - 4.0).abs() < 1e-6, "the oracle: {red} {blue}");
    }
}

/// A table top under an even sky: at its far edge Embree saw the side behind, which is dark, at every width.
#[test]
fn at_the_edge_of_a_box_the_face_behind_is_never_seen() {
    // The line tests in its own arithmetic, and no face behind wins there.
    let text = "[camera]\norigin = [1.5, 2.0, 3.3]\ntarget = [0.0, 0.65, 0.0]\nup = [0, 1, 0]\nfov_x = 40\n\
        [film]\nwidth = 78\nheight = 59\n[environment]\nemission = [1, 1, 1]\n[materials.wood]\ndiffuse = [0.35, 0.2, 0.1]\n\
        [[meshes]]\nmaterial = \"wood\"\n\
        vertices = [[-0.8,0.70,-0.5],[0.8,0.70,-0.5],[0.8,0.75,-0.5],[-0.8,0.75,-0.5],[-0.8,0.70,0.5],[0.8,0.70,0.5],[0.8,0.75,0.5],[-0.8,0.75,0.5]]\n\
        faces = [[0,1,2,3],[4,5,6,7],[0,1,5,4],[3,2,6,7],[0,3,7,4],[1,2,6,5]]\n";
    let [one, eight, line, line_of_eight] =
        WIDTHS.map(|options| pixels(text, &format!("{options} --sampler independent --spp 1")));
    assert_eq!(differ(&one, &eight), 0);
    assert_eq!(differ(&line, &line_of_eight), 0);
    let seen_otherwise = one
        .iter()
        .zip(&line)
        .filter(|(a, b)| (a[0] - b[0]).abs() > 1e-3)
        .count();
    assert_eq!(seen_otherwise, 0);
}

/// A sphere below the floor gives it no light, however large it is: one of 1e4 shone through with 0.65 for 0.00054.
#[test]
fn large_spheres_stay_below_the_floor() {
    for (radius, gap) in [(1e4, 1e-4), (1e5, 1e-3), (1e6, 1e-3), (1e6, 1e-1), (1e9, 1e-3)] {
        let below = format!(
            "[[spheres]]\ncenter = [0, {}, 0]\nradius = {radius}\nemission = [1, 1, 1]\n",
            -(radius + gap)
        );
        let text = format!("{ROOM}{below}{}", floor("a", ""));
        for options in WIDTHS {
            for estimator in ["light", "mis", "uniform", "brdf"] {
                // The upper rows see beyond the floor.
                let picture = pixels(&text, &format!("{options} --spp 4 --estimator {estimator}"));
                let [red, ..] = mean(&picture[128..]);
                assert!(red < 1e-6, "{options}, {estimator}, radius {radius}, gap {gap}: {red}");
            }
        }
    }
}

/// Large spheres as the ground: a ball on it is lit and shaded as on a plane, to the curvature (2e-6 here) and 5 standard errors.
#[test]
fn a_large_sphere_is_as_good_as_a_plane() {
    let ball = "[[spheres]]\ncenter = [0, 0.3, 0]\nradius = 0.3\nmaterial = \"b\"\n";
    let options = "--spp 64";
    let plane = pixels(&format!("{ROOM}{LAMP}{ball}{}", floor("a", "")), options);
    for radius in [1e6, 1e8] {
        let ground = format!(
            "[[spheres]]\ncenter = [0, {}, 0]\nradius = {radius}\nmaterial = \"a\"\n",
            -radius
        );
        for accel in ["embree", "linear"] {
            let sphere = pixels(
                &format!("{ROOM}{LAMP}{ball}{ground}"),
                &format!("{options} --accel {accel}"),
            );
            // The upper rows see beyond the floor.
            let (plane, sphere) = (&plane[128..], &sphere[128..]);
            let (a, b) = (mean(plane), mean(sphere));
            // Pictures have one seed: they differ by what rounding moves.
            assert!((a[0] / b[0] - 1.0).abs() < 2e-3, "{accel}, {radius}: {a:?} {b:?}");
            let far = plane
                .iter()
                .zip(sphere)
                .filter(|(a, b)| (a[0] - b[0]).abs() > 0.05 * a[0].max(b[0]))
                .count();
            assert!(far < 6, "{accel}, {radius}: {far} pixels differ by more than 5 %");
        }
    }
}

/// A camera on a light looks away from it and sees the scene, as it does a little farther off, and as the oracle does.
#[test]
fn a_camera_on_a_light_sees_the_scene() {
    let with = |z: f64| {
        let light = format!("[[spheres]]\ncenter = [0.3, 2, {z}]\nradius = 0.5\nemission = [3, 3, 3]\n");
        format!("{ROOM}{LAMP}{light}{}", floor("a", ""))
    };
    let truth = oracle(&with(4.5), 64);
    for gap in [0.0, 1e-12, 1e-9, 1e-7, 1e-5] {
        for options in WIDTHS {
            let found = mean(&pixels(&with(4.5 + gap), &format!("{options} --spp 64")));
            assert!(
                (found[0] / truth[0] - 1.0).abs() < 0.02,
                "{options}, {gap}: {found:?} {truth:?}"
            );
        }
    }
    // From inside it is all that there is to see.
    let inside = mean(&pixels(&with(4.5 - 1e-9), "--spp 4"));
    assert!((inside[0] - 3.0).abs() < 1e-6, "{inside:?}");
}

/// Of two spheres that packets cannot tell apart the outer one is seen, whatever the order, and a note names the two.
#[test]
fn of_spheres_with_one_centre_the_outer_one_is_seen() {
    let sphere = |material: &str, radius: f64| {
        format!("[[spheres]]\ncenter = [0, 0.5, 0]\nradius = {radius}\nmaterial = \"{material}\"\n")
    };
    let (inner, outer) = (sphere("b", 0.5), sphere("a", 0.5 + 1e-9));
    let alone = pixels(&format!("{ROOM}{LAMP}{outer}"), "--spp 4");
    for pair in [format!("{inner}{outer}"), format!("{outer}{inner}")] {
        for options in WIDTHS {
            let (picture, said) = render(&format!("{ROOM}{LAMP}{pair}"), &format!("{options} --spp 4"));
            assert!(
                said.contains("have one centre and radii that differ by 1.0e-9"),
                "{said}"
            );
            let lit: Vec<_> = picture.iter().zip(&alone).filter(|(_, b)| b[0] > 0.0).collect();
            assert!(lit.iter().all(|(a, b)| (a[0] / b[0] - 1.0).abs() < 1e-3), "{options}");
        }
    }
}
