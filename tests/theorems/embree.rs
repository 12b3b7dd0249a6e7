//! Exactness below the renderer: do Embree's packets of eight and sixteen, under any mask, answer as its single rays do?
//!
//! Embree has different traversal and intersection kernels for packets and for single rays, and promises nothing. On
//! the rays here they agree to the bit in geometry, primitive, distance, normal and barycentric coordinates, but for
//! what is counted and bounded in one test: rays aimed exactly at shared vertices and edges, where two or more
//! triangles are met at one distance and the first to be tested wins. Lanes that are off must come back without a hit.

use crate::proof::lanes::{InLanes, in_all_widths};
use octolux::embree::{Accel, BoundingSphere, Coherence, Device, Hit, NO_SKIP_ID, Ray, SceneBuilder, TraceLane};
use octolux::lane::{Bits, Lane, Mask};
use octolux::math::Vec3;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// A ray by itself.
#[derive(Clone, Copy, Debug)]
struct Single {
    origin: [f32; 3],
    direction: [f32; 3],
    tfar: f32,
    skip_id: u32,
}

/// What a ray met: geometry and primitive, then the bits of `t`, `u`, `v` and of the normal.
type Met = Option<([u32; 2], [u32; 6])>;

/// Sixteen rays under a mask.
struct Queries<'a> {
    accel: &'a Accel,
    rays: [Single; 16],
    mask: u32,
    coherence: Coherence,
}

impl InLanes for Queries<'_> {
    /// What the ray met, and whether anything blocked it.
    type Said = (Met, bool);
    fn run<L: TraceLane>(&self, first: usize) -> Vec<Self::Said> {
        let vector = |part: fn(&Single) -> [f32; 3]| {
            let column = |k: usize| L::from_fn(|i| part(&self.rays[first + i])[k]);
            Vec3 {
                x: column(0),
                y: column(1),
                z: column(2),
            }
        };
        let rays = Ray {
            origin: vector(|r| r.origin),
            direction: vector(|r| r.direction),
            tfar: L::from_fn(|i| self.rays[first + i].tfar),
            skip_id: L::Bits::from_fn(|i| self.rays[first + i].skip_id),
        };
        let active = L::Mask::from_bitmask(self.mask >> first & ((1 << L::N) - 1));
        let hit = self.accel.intersect(active, &rays, self.coherence);
        let blocked = self.accel.occluded(active, &rays, self.coherence).to_bitmask();
        (0..L::N).map(|i| (met(&hit, i), blocked >> i & 1 == 1)).collect()
    }
}

fn met<L: Lane>(hit: &Hit<L>, lane: usize) -> Met {
    let numbers = [hit.t, hit.u, hit.v, hit.ng.x, hit.ng.y, hit.ng.z];
    (hit.found.to_bitmask() >> lane & 1 == 1).then(|| {
        (
            [hit.geometry.lane(lane), hit.primitive.lane(lane)],
            numbers.map(|x| x.lane(lane).to_bits()),
        )
    })
}

/// How packets and single rays differed.
#[derive(Debug, Default)]
struct Tally {
    rays: u64,
    hits: u64,
    /// Something was met by one and nothing by the other.
    lost: u64,
    /// Another primitive at another distance.
    elsewhere: u64,
    /// Another primitive at the same distance, to 4 ulp: a tie on a shared edge or vertex.
    ties: u64,
    /// The same primitive with other bits in `t`, `u`, `v` or the normal.
    bits: u64,
    /// Lanes that were off and came back with a hit or as occluded.
    leaks: u64,
    /// Answers to "is anything there?" that differ.
    shadows: u64,
    /// Blocked rays.
    blocked: u64,
    examples: String,
}

impl Tally {
    fn take(&mut self, queries: &Queries) {
        let said = in_all_widths(queries);
        for (width, together) in &said[1..] {
            for (lane, (&alone, &together)) in said[0].1.iter().zip(together).enumerate() {
                self.compare(queries, lane, *width, alone, together);
            }
        }
    }

    fn compare(&mut self, queries: &Queries, lane: usize, width: usize, alone: (Met, bool), together: (Met, bool)) {
        if queries.mask >> lane & 1 == 0 {
            self.leaks += u64::from(together.0.is_some() || together.1);
            return;
        }
        self.rays += 1;
        self.hits += u64::from(alone.0.is_some());
        self.blocked += u64::from(alone.1);
        self.shadows += u64::from(alone.1 != together.1);
        match (alone.0, together.0) {
            (a, b) if a == b => return,
            (Some((a, x)), Some((b, y))) => {
                *(if a == b {
                    &mut self.bits
                } else if x[0].abs_diff(y[0]) <= 4 {
                    &mut self.ties
                } else {
                    &mut self.elsewhere
                }) += 1;
            }
            _ => self.lost += 1,
        }
        if self.examples.len() < 100_000 {
            let (ray, mask) = (&queries.rays[lane], queries.mask);
            self.examples +=
                &format!("{ray:?} lane {lane} of {width}, {mask:016b}\n alone {alone:x?}\n packet {together:x?}\n");
        }
    }

    /// Fails, naming the list of rays, unless `holds`.
    fn expect(&self, name: &str, holds: bool) {
        let path = crate::proof::artefact(&format!("embree-{name}.txt"));
        let figures = Tally {
            examples: String::new(),
            ..*self
        };
        std::fs::write(&path, format!("{figures:#?}\n{}", self.examples)).expect("the target folder can be written to");
        assert!(holds, "{name}: {figures:?}, rays in {}", path.display());
    }
}

/// A field of 24 x 24 hills, closely triangulated, and spheres of radii from 1e-3 to 1 over it, the largest hollow and
/// around some of the origins.
struct Field {
    accel: Accel,
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    balls: Vec<BoundingSphere>,
}

fn field() -> Field {
    const SIDE: u32 = 25;
    let mut rng = Pcg64::seed_from_u64(31);
    let mut vertices = vec![];
    for i in 0..SIDE * SIDE {
        let (x, z) = ((i % SIDE) as f32 / 6.0 - 2.0, (i / SIDE) as f32 / 6.0 - 2.0);
        vertices.push([x, rng.random::<f32>() * 0.3 - 1.0, z]);
    }
    let mut triangles = vec![];
    for row in 0..SIDE - 1 {
        for i in row * SIDE..row * SIDE + SIDE - 1 {
            triangles.extend([[i, i + 1, i + SIDE], [i + SIDE, i + 1, i + SIDE + 1]]);
        }
    }
    let mut balls = vec![BoundingSphere {
        center: [0.0; 3],
        radius: 1.0,
    }];
    balls.extend((0..60).map(|i| BoundingSphere {
        center: std::array::from_fn(|_| rng.random::<f32>() * 3.0 - 1.5),
        radius: 0.001 * 10.0_f32.powf(i as f32 / 30.0),
    }));
    let device = Device::new(1).unwrap();
    let mut builder = SceneBuilder::new(&device, true).unwrap();
    builder.add_mesh(&vertices, &triangles).unwrap();
    builder.set_spheres(balls.clone()).unwrap();
    let accel = builder.commit().unwrap();
    Field {
        accel,
        vertices,
        triangles,
        balls,
    }
}

fn unit(rng: &mut Pcg64) -> f32 {
    rng.random::<f32>() * 2.0 - 1.0
}

fn towards(origin: [f32; 3], target: [f32; 3]) -> Single {
    let direction = std::array::from_fn(|k| target[k] - origin[k]);
    Single {
        origin,
        direction,
        tfar: f32::INFINITY,
        skip_id: NO_SKIP_ID,
    }
}

/// Sends `packets` packets under masks of all, one, none and any lanes, both coherences in turn.
fn send(field: &Field, packets: u32, mut ray: impl FnMut(&mut Pcg64) -> Single) -> Tally {
    let mut rng = Pcg64::seed_from_u64(2);
    let mut tally = Tally::default();
    for i in 0..packets {
        let rays = std::array::from_fn(|_| ray(&mut rng));
        let mask = [0xffff, 0xffff, rng.next_u32() & 0xffff, 1 << (i / 4 % 16)][i as usize % 4];
        let coherence = [Coherence::Coherent, Coherence::Incoherent][(i / 7 % 2) as usize];
        tally.take(&Queries {
            accel: &field.accel,
            rays,
            mask,
            coherence,
        });
    }
    field.accel.check().unwrap();
    tally
}

impl Tally {
    fn identical(&self) -> bool {
        self.lost + self.elsewhere + self.ties + self.bits + self.leaks + self.shadows == 0
    }
}

#[test]
fn packets_answer_random_rays_with_the_bits_of_single_rays() {
    let field = field();
    let tally = send(&field, 20_000, |rng| {
        let origin = std::array::from_fn(|_| 3.0 * unit(rng));
        Single {
            // Short rays, long ones and endless ones; some aim at a sphere that must not block them.
            tfar: [0.3, 2.0, f32::INFINITY][rng.random_range(0..3)],
            skip_id: [NO_SKIP_ID, 0, rng.random_range(0..61)][rng.random_range(0..3)],
            ..towards(origin, std::array::from_fn(|_| 1.5 * unit(rng)))
        }
    });
    tally.expect(
        "random",
        tally.identical() && tally.hits > 50_000 && tally.blocked > 50_000,
    );
}

#[test]
fn packets_answer_axis_parallel_rays_with_the_bits_of_single_rays() {
    let field = field();
    let tally = send(&field, 10_000, |rng| {
        let axis = rng.random_range(0..3);
        let mut direction = [0.0, -0.0, 0.0];
        direction[axis] = [1.0, -1.0][rng.random_range(0..2)];
        Single {
            direction,
            ..towards(std::array::from_fn(|_| 2.0 * unit(rng)), [0.0; 3])
        }
    });
    tally.expect("axis-parallel", tally.identical() && tally.hits > 30_000);
}

/// Origins inside the great sphere, on it and outside, targets in, on and just beside spheres.
#[test]
fn packets_answer_rays_at_spheres_with_the_bits_of_single_rays() {
    let field = field();
    let tally = send(&field, 10_000, |rng| {
        let ball = field.balls[rng.random_range(0..field.balls.len())];
        let start = [0.5, 1.0, 4.0][rng.random_range(0..3)];
        let shell: [f32; 3] = std::array::from_fn(|_| unit(rng));
        let length = shell.iter().map(|x| x * x).sum::<f32>().sqrt();
        let aside = [0.0, 0.5, 1.0, 1.0 + 1e-6][rng.random_range(0..4)];
        let target = std::array::from_fn(|k| ball.center[k] + aside * ball.radius * [0.0, 1.0, 0.0][k]);
        towards(shell.map(|x| x * start / length), target)
    });
    tally.expect("spheres", tally.identical() && tally.hits > 50_000);
}

/// Rays from lattice points at shared vertices and at the middles of shared edges.
fn aimed(share: f32) -> Tally {
    let field = field();
    send(&field, 10_000, |rng| {
        let [a, b, _] = field.triangles[rng.random_range(0..field.triangles.len())];
        let [a, b] = [a, b].map(|i| field.vertices[i as usize]);
        let target = std::array::from_fn(|k| a[k] + share * (b[k] - a[k]));
        towards(
            [
                0.25 * rng.random_range(-8..=8) as f32,
                3.0,
                0.25 * rng.random_range(-8..=8) as f32,
            ],
            target,
        )
    })
}

/// At a shared vertex about six triangles are met at one distance, at an edge two. Which of them is named is decided by
/// the order of testing, and that order is not the same in the two kernels: measured, packets name another one for 11 %
/// of the rays at vertices and for 3.5 % at edges, always at the same distance but for 0.02 % at slanting triangles.
/// One ray in 100 000 at a vertex slips through in one kernel only. With the same triangle all bits are the same.
/// Rays of a picture hit a vertex or an edge to the last bit about never, so pictures agree (`proof_pictures.rs`).
#[test]
fn packets_and_single_rays_differ_at_vertices_and_edges_by_ties_alone() {
    for (name, share, most_ties) in [("vertices", 0.0, 0.15), ("edges", 0.5, 0.05)] {
        let tally = aimed(share);
        let (rays, hits) = (tally.rays as f64, tally.hits as f64);
        let rare = (tally.lost + tally.elsewhere + tally.shadows) as f64;
        let bounded = tally.ties as f64 <= most_ties * hits && rare <= 5e-4 * rays;
        tally.expect(
            name,
            bounded && tally.bits == 0 && tally.leaks == 0 && hits > 0.95 * rays,
        );
    }
}

/// Idle lanes of a packet may hold anything: numbers that are no numbers, directions of length 0.
#[test]
fn what_idle_lanes_hold_changes_nothing() {
    let field = field();
    let mut rng = Pcg64::seed_from_u64(4);
    let mut tally = Tally::default();
    for i in 0..5_000_usize {
        let poison = [f32::NAN, f32::INFINITY, 0.0, f32::MAX][i % 4];
        let mask = rng.next_u32() & 0xffff;
        let rays = std::array::from_fn(|lane| {
            let mut ray = towards(std::array::from_fn(|_| 3.0 * unit(&mut rng)), [0.0; 3]);
            if mask >> lane & 1 == 0 {
                ray.direction = [poison; 3];
                ray.origin = [poison, 1.0, poison];
            }
            ray
        });
        tally.take(&Queries {
            accel: &field.accel,
            rays,
            mask,
            coherence: Coherence::Incoherent,
        });
    }
    tally.expect("idle", tally.identical() && tally.hits > 30_000);
}
