//! Short lists of lights: with many lights, each pass samples only a few of them for the points of a tile.
//!
//! Points of one [`Group`] of a tile's pixels, BRDF model and pass share a list. The list, and the [`Table`] from which it is sampled,
//! depend only on the scene, the film, the seed, the tile and the pass: not on lanes, threads, chunks or hits. The pixels of the two
//! colors of a checkerboard have separate lists: in adaptive renders each color determines the sample counts of the other, so the two
//! must be independent ([`allocation`](crate::film::allocation)).

mod address;
mod members;
mod probe;

use std::sync::OnceLock;
use std::time::{Duration, Instant};

pub use address::{Group, ListAddress};
pub use members::{Draws, Lights, Member};
use probe::VisibilityProbe;

use super::model::{self, Model};
use super::stage::{Chunk, Request};
use super::tracer::Tracer;
use crate::bsdf::Microfacets;
use crate::estimator::density::Mix;
use crate::film::{TILE, Tile};
use crate::lane::Lane;
use crate::light::tree::{Pick, Table};
use crate::light::{DeltaLight, LightTree};
use crate::math::Vec3;
use crate::scene::FilmSize;

/// Scale from world lengths to lengths of the tree: at most 2^11, so that third powers of long and short lengths fit into `f32`.
pub(super) const UNIT: f32 = 1.0 / (1 << 18) as f32;

/// Tables by pass: first pass, number of clusters, number of probe points that trace rays to them, at most 16. Finer tables
/// pay off if they serve more passes.
const LEVELS: [(u32, usize, usize); 3] = [(0, 64, 0), (4, 256, 8), (32, 1024, 16)];

/// Maximum memory of all tables of a film, in bytes. Tables of large films have fewer clusters.
const MOST_BYTES: usize = 1 << 28;

/// Bytes per cluster in a table.
const CLUSTER: usize = 20;

/// The BRDF model of a table's points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Diffuse,
    Phong,
    Ggx,
    Conductor,
}

/// Number of kinds.
const KINDS: usize = 4;

/// A BRDF model for which lists are made.
pub trait Probed: Model {
    /// The table of the model.
    const KIND: Kind;
    /// Axis and exponent of its lobes, by which points may walk down the tree by themselves.
    #[inline(always)]
    fn lobe<L: Lane>(_: &Self::Of<L>) -> Option<(Vec3<L>, L)> {
        None
    }
}

impl Probed for model::Diffuse {
    const KIND: Kind = Kind::Diffuse;
}
impl Probed for model::Phong {
    const KIND: Kind = Kind::Phong;
    #[inline(always)]
    fn lobe<L: Lane>(bsdf: &Self::Of<L>) -> Option<(Vec3<L>, L)> {
        Some((bsdf.wr, bsdf.alpha))
    }
}
impl Probed for model::Ggx {
    const KIND: Kind = Kind::Ggx;
}
impl Probed for model::Conductor {
    const KIND: Kind = Kind::Conductor;
    #[inline(always)]
    fn lobe<L: Lane>(bsdf: &Self::Of<L>) -> Option<(Vec3<L>, L)> {
        let Microfacets { n, wo, alpha } = bsdf.facets;
        let cosine = n.dot(wo);
        // As of the probes.
        let exponent = L::splat(0.25) / (alpha * alpha).max(L::splat(f32::MIN_POSITIVE));
        let exponent = exponent.max(L::splat(1.1)).min(L::splat(1000.0));
        Some((n * (cosine + cosine) - wo, exponent))
    }
}

/// The source of the lists of lights.
#[derive(Debug)]
pub struct Lists {
    tree: LightTree,
    /// Index of each light in the order of leaves.
    places: Vec<u32>,
    /// For each sphere, its light index, or `u32::MAX`.
    of_sphere: Vec<u32>,
    /// For each mesh, the light index of its first triangle, or `u32::MAX`.
    of_mesh: Vec<u32>,
    /// Numbers of spheres, triangles and delta lights.
    counts: [usize; 3],
    /// The delta lights that are in no list.
    others: Vec<DeltaLight>,
    /// Length of a list.
    length: u32,
    build_time: Duration,
    film: FilmSize,
    /// Maximum number of clusters in a table.
    clusters: usize,
    /// What decides in walks of single lanes instead of lists.
    #[cfg(feature = "rival")]
    pub guide: Option<crate::light::tree::rival::Guide>,
    /// One table per tile, BRDF model and level.
    tables: Vec<[[OnceLock<Box<Table>>; LEVELS.len()]; KINDS]>,
    /// The lists of the delta lights alone, if there are other lights and somebody needed them.
    of_deltas: OnceLock<Box<Lists>>,
}

impl Lists {
    /// Lists of `length` lights for the tiles of a film; `of_mesh` gives the first triangle light of each mesh.
    pub fn new(lights: Lights, spheres: usize, of_mesh: &[u32], length: u32, film: FilmSize) -> Self {
        let begin = Instant::now();
        let tree = LightTree::new(&lights.emitters());
        let mut of_sphere = vec![u32::MAX; spheres];
        for (number, light) in (0..).zip(lights.spheres) {
            of_sphere[light.sphere as usize] = number;
        }
        let counts = lights.counts();
        let first = counts[0] as u32;
        let tiles = film.width.div_ceil(TILE) as usize * film.height.div_ceil(TILE) as usize;
        Self {
            #[cfg(feature = "rival")]
            guide: guide(&tree, lights),
            places: tree.places(counts.iter().sum()),
            tree,
            of_sphere,
            of_mesh: of_mesh.iter().map(|&at| at.saturating_add(first)).collect(),
            counts,
            others: lights.others(),
            length,
            build_time: begin.elapsed(),
            film,
            clusters: (MOST_BYTES / (tiles * 2 * CLUSTER)).max(LEVELS[0].1),
            tables: (0..tiles).map(|_| Default::default()).collect(),
            of_deltas: OnceLock::new(),
        }
    }

    /// The lists that an estimator draws from, if any; `deltas` are the delta lights of [`Self::new`].
    pub fn drawn_by(&self, draws: Draws, deltas: &[DeltaLight]) -> Option<&Self> {
        match draws {
            Draws::Nothing => None,
            Draws::Deltas if self.has_shapes() => Some(self.of_deltas.get_or_init(|| {
                let lights = Lights::new(&[], &[], deltas);
                Box::new(Self::new(lights, 0, &[], self.length, self.film))
            })),
            Draws::Deltas | Draws::All => Some(self),
        }
    }

    /// Maximum length of a list.
    pub fn length(&self) -> u32 {
        self.length
    }

    /// Walks down the tree of a point in a pass, where points walk. A walk with its ray takes longer than a ray to a listed light.
    pub fn walks(&self) -> u32 {
        (self.length / 2).max(1)
    }

    /// All pixels of a tile in squares of 4 x 4. A replay has a one-pixel tile and must build the same table.
    fn pixels(&self, number: u32) -> Vec<[u32; 2]> {
        let FilmSize { width, height } = self.film;
        let across = width.div_ceil(TILE);
        let (left, top) = (number % across * TILE, number / across * TILE);
        let place = |i: u32| [left + i / 16 % 4 * 4 + i % 4, top + i / 64 * 4 + i / 4 % 4];
        let pixels = (0..TILE * TILE).map(place);
        pixels.filter(|&[x, y]| x < width && y < height).collect()
    }

    /// Build time of the tree.
    pub fn build_time(&self) -> Duration {
        self.build_time
    }

    /// The tree.
    pub fn tree(&self) -> &LightTree {
        &self.tree
    }

    /// Memory in bytes, without the lights and without tables.
    pub fn bytes(&self) -> usize {
        self.tree.bytes() + 4 * (self.places.len() + self.of_sphere.len() + self.of_mesh.len())
    }

    /// Whether any lights have a shape, which rays may hit.
    fn has_shapes(&self) -> bool {
        self.counts[0] + self.counts[1] > 0
    }

    /// The delta lights that are in no list, because they have no position.
    pub fn others(&self) -> &[DeltaLight] {
        &self.others
    }

    /// How light and BRDF sampling are combined, where spheres may have a mix of their own.
    pub fn mix(&self, of_spheres: Mix, of_triangles: Mix) -> Mix {
        match self.counts {
            // No direction of a BRDF finds these.
            [0, 0, _] => Mix::Light,
            [_, 0, _] => of_spheres,
            _ => of_triangles,
        }
    }

    /// Light index of a sphere.
    pub fn of_sphere(&self, sphere: u32) -> Option<u32> {
        self.of_sphere
            .get(sphere as usize)
            .copied()
            .filter(|&light| light != u32::MAX)
    }

    /// Light index of a triangle of a mesh.
    pub fn of_triangle(&self, mesh: u32, triangle: u32) -> Option<u32> {
        let first = self
            .of_mesh
            .get(mesh as usize)
            .copied()
            .filter(|&first| first != u32::MAX);
        first.map(|first| first + triangle)
    }

    /// The kind of a light, and its index among the lights of its kind.
    pub fn kind(&self, light: u32) -> Member {
        let (light, [spheres, triangles, _]) = (light as usize, self.counts);
        if light < spheres {
            Member::Sphere(light)
        } else if light < spheres + triangles {
            Member::Triangle(light - spheres)
        } else {
            Member::Delta(light - spheres - triangles)
        }
    }

    /// Index of a light in the order of leaves.
    pub fn place(&self, light: u32) -> u32 {
        self.places[light as usize]
    }

    /// Estimated number of times a light is in a list: see [`Table::guess`]. `None` if it emits nothing.
    pub fn guess(&self, table: &Table, light: u32) -> Option<f32> {
        let place = self.places[light as usize];
        (place != u32::MAX).then(|| table.guess(&self.tree, place))
    }

    /// The table for the points of a tile, a model and a pass, if it was built.
    pub fn table(&self, tile: &Tile, kind: Kind, pass: u32) -> Option<&Table> {
        self.tables[tile.number() as usize][kind as usize][level(pass)]
            .get()
            .map(|table| &**table)
    }

    /// The same, which is built if nobody has needed it before.
    pub fn tabulated(&self, chunk: &mut Chunk, kind: Kind, pass: u32) -> Option<&Table> {
        if self.table(chunk.tile, kind, pass).is_none() {
            let lists = self;
            chunk.request(Request::Tabulate { lists, kind, pass });
        }
        self.table(chunk.tile, kind, pass)
    }

    /// Builds that table. Its rays are always traced in eight lanes, so the table is the same for all plans.
    #[inline(never)]
    pub fn tabulate<T: Tracer>(&self, chunk: &Chunk, kind: Kind, pass: u32) {
        let level = level(pass);
        let (_, clusters, looks) = LEVELS[level];
        let tables = &self.tables[chunk.tile.number() as usize][kind as usize];
        tables[level].get_or_init(|| {
            // The probes of all levels are the same.
            let known = tables[..level].iter().find_map(OnceLock::get);
            let probes = known.map_or_else(|| probe::find::<T>(chunk, self, kind), |table| table.probes().clone());
            let mut visibility = VisibilityProbe::<T>::new(chunk.world, self, &probes, looks);
            let look = (looks > 0 && !probes.is_empty()).then_some(&mut visibility as _);
            let most = clusters.min(self.clusters);
            Box::new(Table::new(&self.tree, probes, most, self.length, look))
        });
    }

    /// Numbers of tables so far by which points walk, and of lists.
    pub fn tables(&self) -> [usize; 2] {
        let mut numbers = [0; 2];
        for table in self.tables.iter().flatten().flatten().filter_map(OnceLock::get) {
            numbers[usize::from(!table.walked())] += 1;
        }
        numbers
    }

    /// Samples the list of a tile's pixels of one color for a pass.
    pub fn draw(&self, table: &Table, address: &ListAddress, list: &mut Vec<Pick>) {
        table.draw(&self.tree, |stratum| address.number(stratum), list);
    }
}

/// The table level of a pass.
pub fn level(pass: u32) -> usize {
    LEVELS.iter().rposition(|&(first, ..)| first <= pass).unwrap_or(0)
}

/// What `OCTOLUX_RIVAL` asks for: `moments` or `bounds`.
#[cfg(feature = "rival")]
fn guide(tree: &LightTree, lights: Lights) -> Option<crate::light::tree::rival::Guide> {
    use crate::light::TriangleLight;
    use crate::light::tree::rival::Guide;
    let [spheres, triangles, _] = lights.counts();
    let bounds = |leaf: u32| {
        let light = tree.light(leaf) as usize;
        let Some(sphere) = lights.spheres.get(light) else {
            let Some(TriangleLight { triangle, .. }) = lights.triangles.get(light - spheres) else {
                let (position, _) = lights.deltas[light - spheres - triangles]
                    .position()
                    .unwrap_or_default();
                return (position.map(|x| x * UNIT), position.map(|x| x * UNIT), None);
            };
            let end = |most: fn(f32, f32) -> f32| -> [f32; 3] {
                std::array::from_fn(|k| {
                    triangle
                        .corners
                        .map(|c| c[k] * UNIT)
                        .into_iter()
                        .reduce(most)
                        .unwrap_or(0.0)
                })
            };
            return (end(f32::min), end(f32::max), Some(triangle.normal));
        };
        let end = |side: f32| sphere.center.map(|x| (x + side * sphere.radius) * UNIT);
        (end(-1.0), end(1.0), None)
    };
    match std::env::var("OCTOLUX_RIVAL").ok()?.as_str() {
        "moments" => Some(Guide::Moments),
        "bounds" => Some(Guide::Bounds(tree.bounds(bounds))),
        _ => None,
    }
}
