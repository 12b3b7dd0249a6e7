//! Names of shapes in messages: by number and position, or by name.

use octolux::scene::Scene;
use octolux::study::verify::sanity::plural;

/// "1 sample was", "2 samples were".
pub fn were(count: u64, noun: &str) -> String {
    format!(
        "{} {}",
        plural(count as usize, noun),
        if count == 1 { "was" } else { "were" }
    )
}

/// A sphere by its number, from 1 as in the file, and its position.
pub fn sphere(scene: &Scene, index: usize) -> String {
    let place = scene.spheres()[index].center;
    let [x, y, z] = place.to_array();
    format!("sphere {} at {}, {}, {}", index + 1, short(x), short(y), short(z))
}

/// A mesh by its name in the file, with the centre of its bounding box.
pub fn mesh(scene: &Scene, index: usize) -> String {
    let mesh = &scene.meshes()[index];
    let corners = mesh
        .triangles
        .iter()
        .flatten()
        .map(|&corner| mesh.vertices[corner as usize]);
    let ends = corners.fold(None, |ends, v| {
        let (low, high) = ends.unwrap_or((v, v));
        Some((v.min(low), v.max(high)))
    });
    let middle = ends.map(|(low, high)| ((low + high) / 2.0).to_array());
    let place = middle.map(|[x, y, z]| format!(" at {}, {}, {}", short(x), short(y), short(z)));
    let name = match mesh.name.as_str() {
        "" => format!("mesh {}", index + 1),
        name => name.replace("[[meshes]]", "mesh").replace("[[boxes]]", "box"),
    };
    format!("{name}{}", place.unwrap_or_default())
}

/// A light without shape, by its number and position.
pub fn light(scene: &Scene, index: usize) -> String {
    let place = scene.lights()[index].position().map(|at| at.to_array());
    let place = place.map_or(", directional".to_owned(), |[x, y, z]| {
        format!(" at {}, {}, {}", short(x), short(y), short(z))
    });
    format!("light {}{place}", index + 1)
}

/// Up to four digits.
fn short(x: f64) -> String {
    let digits = if x == 0.0 {
        0
    } else {
        (3.0 - x.abs().log10().floor()).clamp(0.0, 9.0) as usize
    };
    let text = format!("{x:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn numbers_are_as_short_as_they_can_be() {
        let cases = [
            (0.0, "0"),
            (-3.75, "-3.75"),
            (1e6, "1000000"),
            (0.033_333_3, "0.03333"),
            (12.0, "12"),
        ];
        for (x, text) in cases {
            assert_eq!(short(x), text);
        }
    }
}
