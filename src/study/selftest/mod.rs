//! The hard cases of direct illumination, each with figures and bounds: a test of the numerics on the user's machine.
//!
//! [`CASES`] is the table. A case is a function from an [`Effort`] to [`Check`]s. The reference is a closed form, quadrature or
//! `f64`, never a stored picture. Seeds are fixed: a case that passes once passes forever.

pub mod bench;
mod cones;
mod emitters;
pub mod files;
mod flag;
mod grid_mesh;
mod lamps;
mod lobes;
mod many;
mod meshes;
mod numbers;
mod packets;
pub mod panels;
pub mod places;
pub mod prices;
mod range;
mod rough;
pub mod row;
mod test_point;
mod truth;
mod whole;

pub use row::{Check, Checks, Effort};

/// A hard case.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its number; 41 to 43 check whole pictures, 44 repeats the hard cases of spheres for meshes.
    pub number: u32,
    /// What is hard.
    pub name: &'static str,
    /// The function that measures it.
    pub run: fn(Effort) -> Checks,
}

const fn case(number: u32, name: &'static str, run: fn(Effort) -> Checks) -> Case {
    Case { number, name, run }
}

/// All cases.
pub const CASES: [Case; 46] = [
    case(1, "tiny distant sphere", cones::tiny_sphere),
    case(2, "direction in a narrow cone", cones::narrow_cone),
    case(3, "density without a switch", cones::no_switch),
    case(4, "sampled point on the sphere", cones::point_on_the_sphere),
    case(5, "shading point inside of a light", emitters::inside),
    case(6, "shading point on a light, +- ulp", emitters::on_the_surface),
    case(7, "light partly below the horizon", emitters::below_the_horizon),
    case(8, "light tangent to the ground", emitters::on_the_ground),
    case(9, "light as wide as half of all directions", cones::half_of_all),
    case(10, "grazing directions", lobes::grazing),
    case(11, "Phong at n = 10^6: value", lobes::value),
    case(12, "Phong at n = 10^6: sampling", lobes::sampling),
    case(13, "Phong exponents near 1, and bad ones", lobes::lowest_exponent),
    case(14, "powers of 0 and of negative cosines", lobes::powers_of_nothing),
    case(15, "random numbers 0 and next to 1", numbers::corners),
    case(16, "weights of extreme densities", numbers::weights),
    case(17, "NaN and infinite samples", numbers::thrown_away),
    case(18, "overlapping lights", emitters::overlapping),
    case(19, "coincident lights, order of lights", emitters::coincident),
    case(20, "nested lights", emitters::nested),
    case(21, "blocker that touches light or surface", places::touching),
    case(22, "scene far from the origin", places::far_away),
    case(23, "scene scaled by powers of two", places::scaled),
    case(24, "self-intersection", places::self_intersection),
    case(25, "rays at edges and vertices", meshes::edges),
    case(26, "triangles without area, needles", meshes::degenerate),
    case(27, "lights without area", meshes::without_area),
    case(28, "broken vertices and corners", meshes::hostile_meshes),
    case(29, "winding, open meshes", meshes::winding),
    case(30, "frames at the poles", numbers::frames),
    case(31, "radiance of 1e20 beside 1e-20", range::bright_beside_dim),
    case(32, "denormal numbers", range::denormals),
    case(33, "long sums", range::long_sums),
    case(34, "a million lights", many::many_lights),
    case(35, "no light, one, and without power", emitters::few_lights),
    case(36, "films of awkward sizes", packets::awkward_films),
    case(37, "packets with idle lanes", packets::idle_lanes),
    case(38, "BRDF sampling of a tiny light", emitters::fireflies),
    case(39, "files that cannot be written", files::writing),
    case(40, "hostile files", files::hostile),
    case(41, "white furnace", whole::furnace),
    case(42, "reciprocity", whole::reciprocity),
    case(43, "estimators agree tile by tile", whole::estimators_agree),
    case(44, "meshes that emit, where spheres are hard", panels::emitting_meshes),
    case(45, "mirrors, rough surfaces at grazing angles", rough::grazing),
    case(46, "lights without a shape", lamps::no_shapes),
];
