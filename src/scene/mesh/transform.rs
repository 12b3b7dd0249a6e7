//! `transform = { scale, rotate_x, rotate_y, rotate_z, rotate, translate }`: applied in this order, not in the order of the
//! keys.

use glam::{DMat3, DMat4, DVec3};

use super::super::error::Fault;
use super::super::rule::{FINITE, NOT_ZERO};
use super::super::table::Table;
use super::super::value::Value;
use super::RawMesh;

const KEYS: &[&str] = &["scale", "rotate_x", "rotate_y", "rotate_z", "rotate", "translate"];

/// The matrix from mesh space to scene space; the identity without a table.
pub fn transform(value: Option<Value<'_>>) -> Result<DMat4, Fault> {
    let Some(value) = value else { return Ok(DMat4::IDENTITY) };
    let table = value.table("transform".to_owned(), "transform", KEYS)?;
    let scale = match table.get("scale") {
        None => DVec3::ONE,
        Some(scale) if scale.is_list() => scale.ruled_triple(&NOT_ZERO)?,
        Some(scale) => DVec3::splat(scale.ruled(&NOT_ZERO)?),
    };
    let turn = rotations(&table)?;
    let translate = table
        .get("translate")
        .map_or(Ok(DVec3::ZERO), |value| value.ruled_triple(&FINITE))?;
    Ok(DMat4::from_mat3_translation(
        turn * DMat3::from_diagonal(scale),
        translate,
    ))
}

/// The rotation by `rotate_x`, `rotate_y`, `rotate_z` and `rotate` of a table, applied in this order.
pub fn rotations(table: &Table<'_>) -> Result<DMat3, Fault> {
    let turn = |key, axis| match table.get(key) {
        None => Ok(DMat3::IDENTITY),
        Some(degrees) => degrees.ruled(&FINITE).map(|degrees| rotation(axis, degrees)),
    };
    let about = table
        .get("rotate")
        .map_or(Ok(DMat3::IDENTITY), |value| about_axis(&value))?;
    Ok(about * turn("rotate_z", 2)? * turn("rotate_y", 1)? * turn("rotate_x", 0)?)
}

/// `rotate = [x, y, z, degrees]`: a rotation about the axis `(x, y, z)` through the origin.
fn about_axis(value: &Value<'_>) -> Result<DMat3, Fault> {
    let help = "write an axis and degrees, such as rotate = [0, 1, 0, 30], or rotate_y = 30";
    if value.numbers::<4>().is_err() {
        return Err(value.fault("must be an axis and degrees", help));
    }
    let [x, y, z, degrees] = value.ruled_numbers::<4>(&FINITE)?;
    let axis = DVec3::new(x, y, z);
    let size = axis.abs().max_element();
    if size == 0.0 {
        return Err(value.fault("must have an axis other than 0", help));
    }
    let along: Vec<usize> = (0..3).filter(|&k| axis[k] != 0.0).collect();
    Ok(match along[..] {
        // Quarter turns about coordinate axes are exact.
        [k] => rotation(k, degrees * axis[k].signum()),
        _ => DMat3::from_axis_angle((axis / size).normalize(), (degrees % 360.0).to_radians()),
    })
}

/// A rotation about a coordinate axis, counter-clockwise when the axis points at the viewer. Quarter turns are exact.
fn rotation(axis: usize, degrees: f64) -> DMat3 {
    let degrees = degrees % 360.0;
    let quarters = degrees / 90.0;
    let (sin, cos) = match quarters.rem_euclid(4.0) {
        0.0 => (0.0, 1.0),
        1.0 => (1.0, 0.0),
        2.0 => (0.0, -1.0),
        3.0 => (-1.0, 0.0),
        _ => degrees.to_radians().sin_cos(),
    };
    let mut columns = [DVec3::X, DVec3::Y, DVec3::Z];
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    columns[u][u] = cos;
    columns[u][v] = sin;
    columns[v][u] = -sin;
    columns[v][v] = cos;
    DMat3::from_cols(columns[0], columns[1], columns[2])
}

/// Transforms points by `matrix`, and normals by its inverse transpose to unit length. A mirror flips the winding of triangles,
/// which preserves their front.
pub fn apply(raw: &mut RawMesh, matrix: DMat4) {
    if matrix == DMat4::IDENTITY {
        return;
    }
    for vertex in &mut raw.vertices {
        *vertex = matrix.transform_point3(*vertex);
    }
    let linear = DMat3::from_mat4(matrix);
    if mirrors(linear) {
        raw.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    }
    let turn = of_normals(linear);
    for normal in raw.normals.iter_mut().flatten() {
        *normal = (turn * *normal).normalize_or_zero();
    }
}

/// Whether the map changes handedness.
pub fn mirrors(linear: DMat3) -> bool {
    linear.x_axis.dot(linear.y_axis.cross(linear.z_axis)) < 0.0
}

/// The normal matrix of `linear`.
pub fn of_normals(linear: DMat3) -> DMat3 {
    // The cofactors are the inverse transpose times the determinant: they exist for every matrix. A mirror has a negative
    // determinant, which would flip the normals.
    let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if mirrors(linear) { cofactors * -1.0 } else { cofactors }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(matrix: DMat4, point: [f64; 3]) -> [f64; 3] {
        matrix.transform_point3(DVec3::from_array(point)).to_array()
    }

    #[test]
    fn quarter_turns_are_exact_and_counter_clockwise() {
        assert_eq!(rotation(0, 90.0) * DVec3::Y, DVec3::Z);
        assert_eq!(rotation(1, 90.0) * DVec3::Z, DVec3::X);
        assert_eq!(rotation(2, 90.0) * DVec3::X, DVec3::Y);
        assert_eq!(rotation(2, -270.0) * DVec3::X, DVec3::Y);
        assert_eq!(rotation(2, 540.0) * DVec3::X, -DVec3::X);
        let third = rotation(1, 30.0) * DVec3::X;
        assert!((third - DVec3::new(0.75_f64.sqrt(), 0.0, -0.5)).length() < 1e-15);
    }

    /// A rotation about the diagonal by a third of a turn takes x to y to z to x.
    #[test]
    fn a_turn_about_the_diagonal_permutes_the_axes_and_about_an_axis_is_that_of_its_key() {
        let text = "d = { rotate = [2, 2, 2, 120] }\ny = { rotate = [0, -3, 0, -90] }\nn = { rotate = [0, 0, 0, 5] }";
        let tree = toml::de::DeTable::parse(text).unwrap();
        let root = Table::root(text, tree.get_ref(), &["d", "y", "n"]).unwrap();
        let diagonal = transform(root.get("d")).unwrap();
        assert!((diagonal.transform_point3(DVec3::X) - DVec3::Y).length() < 1e-15);
        let about_y = transform(root.get("y")).unwrap();
        assert_eq!(about_y.transform_point3(DVec3::Z), rotation(1, 90.0) * DVec3::Z);
        assert!(transform(root.get("n")).is_err());
    }

    #[test]
    fn a_mirror_keeps_normals_outside() {
        let mut raw = RawMesh {
            vertices: vec![DVec3::X, DVec3::Y, DVec3::Z],
            triangles: vec![[0, 1, 2]],
            normals: Some(vec![DVec3::X]),
            ..Default::default()
        };
        apply(&mut raw, DMat4::from_scale(DVec3::new(-2.0, 1.0, 1.0)));
        assert_eq!(raw.vertices, [DVec3::new(-2.0, 0.0, 0.0), DVec3::Y, DVec3::Z]);
        assert_eq!(raw.normals.unwrap(), [DVec3::NEG_X]);
        // The plane through the three points faced away from 0, and it still does.
        assert_eq!(raw.triangles, [[0, 2, 1]]);
    }

    #[test]
    fn normals_stay_perpendicular_under_uneven_scale() {
        let slope = DVec3::new(1.0, -1.0, 0.0);
        let normal = DVec3::new(1.0, 1.0, 0.0);
        let matrix = DMat4::from_scale(DVec3::new(5.0, 1.0, 1.0));
        let mut raw = RawMesh {
            vertices: vec![slope],
            triangles: vec![],
            normals: Some(vec![normal]),
            ..Default::default()
        };
        apply(&mut raw, matrix);
        assert!(raw.vertices[0].dot(raw.normals.unwrap()[0]).abs() < 1e-15);
        assert_eq!(moved(matrix, [1.0, 2.0, 3.0]), [5.0, 2.0, 3.0]);
    }
}
