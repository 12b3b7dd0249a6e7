//! A prepass that classifies pixels. Its rays use random numbers that no render uses. The result therefore depends only on the
//! scene and the film, and decisions based on it introduce no bias.

use rayon::prelude::*;

use super::model::{Conductor, Diffuse, Ggx, Model, Phong, Streams};
use super::prepared::Prepared;
use super::progress::Counters;
use super::stage::{Chunk, Scratch};

use crate::film::allocation::Kind;
use crate::film::{Film, TILE, Tile};
use crate::sampling::PassBlock;
use crate::scene::{FilmSize, SamplerKind};

/// The pass number of these rays; no render has this many passes.
const PASS: u32 = 1 << 31;

/// Side of the pixel squares that share one ray.
const CELL: u32 = 2;

/// From this pass on, points that see a light partially trace two rays to it. Earlier passes stay cheap, to show an image soon.
pub const SPLIT_FROM: u32 = 4;

/// For each tile, the [marks](super::stage::Penumbra) of each pixel; empty if no pixel is marked.
pub type Partly = Vec<Vec<u32>>;

/// Which lights are partially visible around each pixel.
pub fn partly(prepared: &Prepared) -> Partly {
    let mut film = Film::new(prepared.settings.film);
    let tiles = film.tiles_mut().par_iter_mut();
    prepared
        .pool
        .install(|| tiles.map(|tile| partly_of(prepared, tile)).collect())
}

/// The marks of the pixels of one tile; empty if no pixel is marked. They depend on no other tile.
pub fn partly_of(prepared: &Prepared, tile: &mut Tile) -> Vec<u32> {
    let Some(find_penumbrae) = prepared.plan.find_penumbrae else {
        return Vec::new();
    };
    let own_ray = |at: u32| at.is_multiple_of(CELL);
    tile.set_goals(|[x, y]| if own_ray(x) && own_ray(y) { u32::MAX } else { 0 });
    let marks = look(prepared, tile, |chunk, scratch| {
        find_penumbrae(chunk, scratch);
        std::mem::take(&mut scratch.partly)
    });
    if marks.iter().all(|&mark| mark == 0) {
        return Vec::new();
    }
    let mut of_cell = [[0; 16]; 16];
    for (&[x, y], mark) in tile.offsets().iter().zip(marks) {
        of_cell[(y / CELL) as usize][(x / CELL) as usize] |= mark;
    }
    let mark = |&[x, y]: &[u32; 2]| of_cell[(y / CELL) as usize][(x / CELL) as usize];
    tile.offsets().iter().map(mark).collect()
}

/// What the ray through a pixel hit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Traced {
    position: [f32; 3],
    normal: [f32; 3],
    /// 0 for nothing, [`SHINES`] for an emitter; for a surface, a code for its model and its exponent or roughness.
    what: f32,
}

const SHINES: f32 = -1.0;

impl Traced {
    /// Whether two hits may belong to one smooth surface: same model, normals less than 26 degrees apart, and each point at most 12
    /// degrees off the other's tangent plane.
    fn joins(&self, other: &Self) -> bool {
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let way = [0, 1, 2].map(|k| other.position[k] - self.position[k]);
        let off = |normal| dot(normal, way).powi(2) > 0.04 * dot(way, way);
        let apart = dot(self.normal, other.normal) < 0.9 || off(self.normal) || off(other.normal);
        self.what == other.what && (self.what == 0.0 || self.what == SHINES || !apart)
    }
}

/// The four neighbors after a pixel: with them all pairs of neighbors are looked at once, as joining is mutual.
const AFTER: [(i32, u32); 4] = [(1, 0), (-1, 1), (0, 1), (1, 1)];

/// Mark of a pixel whose ray hit an emitter. The bits below it are the neighbors in [`AFTER`] that the pixel does not join.
const SHINING: u8 = 1 << AFTER.len();

/// Classifies each pixel, row by row, from the rays through it and its eight neighbors.
///
/// Of the hits only those at the borders of the rows of tiles are kept, since memory that is new to a process is dear: all hits of 768 x
/// 512 pixels would be 11 MB.
pub fn kinds(prepared: &Prepared) -> Vec<Kind> {
    let FilmSize { width, height } = prepared.settings.film;
    let film = Film::new(prepared.settings.film);
    let at = |x: u32, y: u32| y as usize * width as usize + x as usize;
    let rows_of_tiles = height.div_ceil(TILE);
    let mut marks = vec![0; at(0, height)];
    let mut tops = vec![Traced::default(); at(0, rows_of_tiles)];
    let mut bottoms = tops.clone();
    prepared.pool.install(|| {
        let tiles = film.tiles().par_chunks(width.div_ceil(TILE) as usize);
        let rows = marks.par_chunks_mut(at(0, TILE)).zip(tiles);
        let borders = tops
            .par_chunks_mut(width as usize)
            .zip(bottoms.par_chunks_mut(width as usize));
        rows.zip(borders)
            .for_each_init(Vec::new, |hits, ((marks, tiles), (top, bottom))| {
                hits.resize(marks.len(), Traced::default());
                for tile in tiles {
                    let [[_, top], _] = tile.corners();
                    let seen = look(prepared, tile, |chunk, scratch| seen(chunk, &scratch.hits));
                    for ([x, y], seen) in tile.pixels().zip(seen) {
                        hits[at(x, y - top)] = seen;
                    }
                }
                for (i, mark) in marks.iter_mut().enumerate() {
                    let shining = if hits[i].what == SHINES { SHINING } else { 0 };
                    *mark = shining
                        | parted(&hits[i], i as u32 % width, width, |dx, dy| {
                            hits.get(i + at(0, dy) + dx - 1)
                        });
                }
                top.copy_from_slice(&hits[..width as usize]);
                bottom.copy_from_slice(&hits[hits.len() - width as usize..]);
            });
        let rows = marks
            .par_chunks_mut(at(0, TILE))
            .zip(bottoms.par_chunks(width as usize));
        rows.zip(tops.par_chunks(width as usize).skip(1))
            .for_each(|((marks, above), below)| {
                let last = marks.len() - width as usize;
                for (x, mark) in marks[last..].iter_mut().enumerate() {
                    let there = |dx, dy| if dy == 1 { below.get(x + dx - 1) } else { None };
                    *mark |= parted(&above[x], x as u32, width, there);
                }
            });
        let kind = |x: u32, y: u32| {
            let mut edge = marks[at(x, y)] & !SHINING != 0;
            for (bit, &(dx, dy)) in AFTER.iter().enumerate() {
                let there = (x.wrapping_sub(dx as u32), y.wrapping_sub(dy));
                edge |= there.0 < width && there.1 < height && marks[at(there.0, there.1)] >> bit & 1 == 1;
            }
            if !edge {
                return Kind::Plain;
            }
            let mut rim = false;
            for row in y.saturating_sub(1)..height.min(y + 2) {
                let around = &marks[at(x.saturating_sub(1), row)..at(width.min(x + 2) - 1, row) + 1];
                rim |= around.iter().any(|mark| mark & SHINING != 0);
            }
            if rim { Kind::Rim } else { Kind::Edge }
        };
        by_row(width, height, kind)
    })
}

/// The neighbors in [`AFTER`] that a pixel of column `x` does not join, a bit each. `there` tells the hit of a neighbor, by its column from
/// the left one's and its row, if it is known.
fn parted<'a>(own: &Traced, x: u32, width: u32, there: impl Fn(usize, u32) -> Option<&'a Traced>) -> u8 {
    let mut parted = 0;
    for (bit, &(dx, dy)) in AFTER.iter().enumerate() {
        if x.wrapping_add_signed(dx) < width
            && let Some(other) = there((dx + 1) as usize, dy)
        {
            parted |= u8::from(!own.joins(other)) << bit;
        }
    }
    parted
}

/// A value of every pixel, row by row.
fn by_row<T: Clone + Default + Send>(width: u32, height: u32, of: impl Fn(u32, u32) -> T + Sync) -> Vec<T> {
    let mut all = vec![T::default(); width as usize * height as usize];
    let rows = all.par_chunks_mut(width as usize).enumerate();
    rows.for_each(|(y, row)| (0..width).zip(row).for_each(|(x, to)| *to = of(x, y as u32)));
    all
}

/// What the pixels of a one-pass chunk hit.
fn seen(chunk: &Chunk, hits: &Streams) -> Vec<Traced> {
    let shines = |sum: &[f64; 4]| if *sum == [0.0; 4] { 0.0 } else { SHINES };
    let nothing = |sum| Traced {
        what: shines(sum),
        ..Traced::default()
    };
    let mut all: Vec<Traced> = chunk.sum.0.iter().map(nothing).collect();
    note::<Diffuse>(hits, &mut all, |_| 1.0);
    note::<Phong>(hits, &mut all, |bsdf| 1.0 + bsdf.alpha);
    note::<Ggx>(hits, &mut all, |bsdf| -1.5 - bsdf.facets.alpha);
    note::<Conductor>(hits, &mut all, |bsdf| -3.5 - bsdf.facets.alpha);
    all
}

/// Records the hits of one model; `what` encodes the surface.
fn note<M: Model>(hits: &Streams, all: &mut [Traced], what: fn(&M::Of<f32>) -> f32) {
    let Some(stream) = M::stream(hits) else { return };
    for at in 0..stream.len() {
        let (_, point, address) = stream.packet::<f32>(at);
        all[address.index.0 as usize] = Traced {
            position: [point.p.x, point.p.y, point.p.z],
            normal: [point.ng.x, point.ng.y, point.ng.z],
            what: what(&point.bsdf),
        };
    }
}

/// Traces a ray through each active pixel of a tile and evaluates `of` on the hits.
fn look<T>(prepared: &Prepared, tile: &Tile, of: impl Fn(&mut Chunk, &mut Scratch) -> T) -> T {
    let plan = &prepared.plan;
    let numbers = PassBlock::new(SamplerKind::Independent, 0, PASS, 1, plan.pairs);
    let (mut sum, mut counters) = (tile.empty_sum(1), Counters::default());
    let mut scratch = prepared.scratch();
    let mut chunk = Chunk {
        world: &prepared.world,
        numbers: &numbers,
        tile,
        film_width: prepared.settings.film.width,
        first: 0,
        pass_order: &[0],
        order: plan.order,
        mix: plan.mix,
        product: plan.product,
        lists: None,
        handler: plan.handler,
        partly: &[],
        sum: &mut sum,
        counters: &mut counters,
        log: None,
    };
    (plan.camera)(&mut chunk, &mut scratch);
    let found = of(&mut chunk, &mut scratch);
    prepared.put_back(scratch);
    found
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::pipeline::Settings;
    use crate::scene::{EstimatorKind, Scene};
    use crate::settings::{AccelKind, Lanes};

    /// A floor seen from above and a light. A plate halfway to the light shadows a square of the floor; the camera sees the plate.
    const SCENE: &str = r#"
[camera]
origin = [0.0, 20.0, 0.0]
target = [0.0, 0.0, 0.0]
up     = [0.0, 0.0, -1.0]
fov_x  = 40.0

[film]
width  = 48
height = 48

[materials.grey]
diffuse = [0.5, 0.5, 0.5]

[[meshes]]
material = "grey"
vertices = [[-50, 0, 50], [50, 0, 50], [50, 0, -50], [-50, 0, -50]]
faces    = [[0, 1, 2, 3]]

[[meshes]]
material = "grey"
vertices = [[3, 5, 1], [5, 5, 1], [5, 5, -1], [3, 5, -1]]
faces    = [[0, 1, 2, 3]]

[[spheres]]
center   = [8.0, 10.0, 0.0]
radius   = 1.0
emission = [10.0, 10.0, 10.0]
"#;

    fn prepared(settings: Settings) -> Prepared {
        let scene = Scene::parse(SCENE, Path::new("plate.toml")).unwrap();
        let settings = Settings {
            film: scene.film(),
            estimator: EstimatorKind::Product,
            ..settings
        };
        Prepared::new(&scene, settings).unwrap()
    }

    /// The marks of all pixels, row by row.
    fn marks(prepared: &Prepared) -> Vec<u32> {
        let mut all = vec![0; 48 * 48];
        for (tile, marks) in Film::new(prepared.settings.film).tiles().iter().zip(partly(prepared)) {
            for ([x, y], mark) in tile.pixels().zip(marks) {
                all[(y * 48 + x) as usize] = mark;
            }
        }
        all
    }

    #[test]
    fn a_sample_of_a_film_that_was_not_surveyed_is_that_of_the_render() {
        let settings = Settings {
            lanes: Some(Lanes::One),
            ..Settings::default()
        };
        let (fresh, surveyed) = (prepared(settings), prepared(settings));
        let marks = marks(&surveyed);
        assert!(surveyed.partly().is_some());
        let mut split = 0;
        for (i, &mark) in marks.iter().enumerate().step_by(7) {
            let [x, y] = [i as u32 % 48, i as u32 / 48];
            let [a, b] = [&fresh, &surveyed].map(|one| one.replay([x, y, SPLIT_FROM]).unwrap().unwrap());
            assert_eq!(a.radiance, b.radiance, "{x},{y}");
            assert_eq!(a.asked.len(), b.asked.len(), "{x},{y}");
            split += usize::from(mark == 1 && a.asked.len() == 2);
        }
        assert!(split > 5, "{split} points see the light in part");
        assert!(!fresh.has_surveyed(), "a sample surveys its tile alone");
    }

    /// Where the ray through a pixel center hits the floor.
    fn floor(i: usize) -> [f64; 2] {
        let of = |pixel: usize| (pixel as f64 + 0.5 - 24.0) / 24.0 * 20.0 * 20.0_f64.to_radians().tan();
        [of(i % 48), of(i / 48)]
    }

    #[test]
    fn a_light_is_seen_in_part_at_the_border_of_its_shadow() {
        let marks = marks(&prepared(Settings::default()));
        // From the light's center, the shadow of the plate is x from -2 to 2, z from -2 to 2. Half a penumbra is 1 wide (1.2 in x).
        let depth = |[x, z]: [f64; 2]| 2.0 - x.abs().max(z.abs());
        let mut border = 0;
        for (i, &mark) in marks.iter().enumerate() {
            // The plate hides the floor from the camera for x from 4 to 6.7. A pixel is 0.3 wide, and every second pixel has a ray.
            let depth = depth(floor(i));
            if depth.abs() < 0.2 {
                border += 1;
                assert_eq!(mark, 1, "{:?}", floor(i));
            } else if depth.abs() > 2.0 && floor(i)[0] < 3.0 {
                assert_eq!(mark, 0, "{:?}", floor(i));
            }
        }
        assert!(border > 20, "{border}");
    }

    #[test]
    fn lanes_threads_seeds_and_intersectors_see_the_same() {
        let one = prepared(Settings::default());
        let (marks_of_one, kinds_of_one) = (marks(&one), kinds(&one));
        for (lanes, accel, threads, seed) in [
            (Lanes::One, AccelKind::Linear, 1, 0),
            (Lanes::Eight, AccelKind::Embree, 2, 5),
            (Lanes::One, AccelKind::Embree, 1, 9),
        ] {
            let other = prepared(Settings {
                lanes: Some(lanes),
                accel: Some(accel),
                threads,
                seed,
                ..Settings::default()
            });
            assert!(marks(&other) == marks_of_one, "{lanes} lanes, {}", accel.name());
            assert!(kinds(&other) == kinds_of_one, "{lanes} lanes, {}", accel.name());
        }
    }

    #[test]
    fn edges_are_where_one_surface_ends_before_another() {
        let kinds = kinds(&prepared(Settings::default()));
        let edges = kinds.iter().filter(|&&kind| kind == Kind::Edge).count();
        // The plate is 2 of 14.56 x 15 / 20 wide there: 8.8 pixels a side, with an edge two or three pixels thick.
        assert!((4 * 7 * 2..4 * 10 * 3).contains(&edges), "{edges}");
        // The plate's center and a part of the floor are plain; no light is in view.
        assert_eq!([kinds[24 * 48 + 41], kinds[24 * 48 + 10]], [Kind::Plain; 2]);
        assert!(!kinds.contains(&Kind::Rim));
    }
}
