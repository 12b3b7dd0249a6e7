//! Tests lists against sums over all lights, and against counts.

use super::*;
use crate::light::tree::{Emission, Emitter};
use crate::sampling::hash::mix;

fn unit(i: u32) -> f32 {
    (mix(i) >> 8) as f32 / 16_777_216.0
}

/// Lights with powers over four orders of magnitude in a box; a third of each kind.
fn lights(number: u32) -> Vec<Emitter> {
    let n = [0.0, 0.6, 0.8];
    let light = |i: u32| Emitter {
        light: i,
        mean: std::array::from_fn(|k| 10.0 * unit(9 * i + k as u32)),
        variance: [1e-5; 3],
        emission: [Emission::Round, Emission::OneSide(n), Emission::BothSides(n)][i as usize % 3],
        intensity: 10_f64.powf(4.0 * f64::from(unit(9 * i + 5))),
    };
    (0..number).map(light).collect()
}

fn probes(phong: bool, seed: u32) -> Probes {
    let mut probes = Probes::new(phong);
    for i in 0..16 {
        let at = |k: u32| 10.0 * unit(mix(seed) ^ (31 * i + k));
        probes.push([at(0), -1.0, at(1)], [0.0, 1.0, 0.0], [0.6, 0.8, 0.0], 50.0);
    }
    probes
}

/// A wall: lights beyond it are visible from no point, the others from all.
struct Wall(Vec<Emitter>);

impl Look for Wall {
    fn reaches(&mut self, light: u32, _: &Probes) -> u32 {
        if self.0[light as usize].mean[0] > 6.0 {
            0
        } else {
            0xffff
        }
    }
}

/// Expected count of each light in a list, by enumerating all paths down the tree.
fn expectations(table: &Table, tree: &LightTree) -> Vec<f64> {
    let mut expected = vec![0.0; tree.len()];
    for &cluster in &table.always {
        expected[tree.light(table.firsts[cluster as usize]) as usize] = 1.0;
    }
    let mut start = 0.0;
    for (&cluster, &end) in table.order.iter().zip(&table.ends) {
        let node = table.nodes[cluster as usize];
        let mut open = vec![(node, end - start)];
        while let Some((number, chance)) = open.pop().filter(|(_, chance)| *chance > 0.0) {
            match tree.node(number).leaf() {
                Some(leaf) => expected[tree.light(leaf) as usize] += chance,
                None => {
                    let link = tree.node(number).link;
                    let first = table.first_chance(tree, link);
                    open.extend([(link, chance * first), (link + 1, chance * (1.0 - first))]);
                }
            }
        }
        start = end;
    }
    expected
}

/// Tables of all kinds over this many lights, with the lists' length.
fn each_table(number: u32, mut check: impl FnMut(&LightTree, &Table, u32)) {
    let emitters = lights(number);
    let tree = LightTree::new(&emitters);
    for (seed, length) in [(1, 1), (2, 2), (3, 16), (4, 40)] {
        for phong in [false, true] {
            for most in [1, 64, 300] {
                let mut wall = Wall(emitters.clone());
                check(
                    &tree,
                    &Table::new(&tree, probes(phong, seed), most, length, None),
                    length,
                );
                check(
                    &tree,
                    &Table::new(&tree, probes(phong, seed), most, length, Some(&mut wall)),
                    length,
                );
                check(
                    &tree,
                    &Table::new(&tree, Probes::new(phong), most, length, None),
                    length,
                );
            }
        }
    }
}

#[test]
fn expectations_of_all_lights_sum_to_the_length_of_a_list_and_none_is_0() {
    for number in [2, 17, 65, 500] {
        each_table(number, |tree, table, length| {
            let expected = expectations(table, tree);
            let wanted = table.length() as f64;
            assert!(table.length() <= length as usize, "{number}, {length}: {wanted}");
            assert!(
                number < length || table.length() == length as usize,
                "{number}, {length}: {wanted}"
            );
            let sum: f64 = expected.iter().sum();
            assert!((sum - wanted).abs() < 1e-9 * wanted, "{number}, {length}: {sum}");
            assert!(expected.iter().all(|&n| n > 0.0));
        });
    }
}

/// Samples many lists. A pick must report its expected count, and the estimate that [`Table::guess`] gives.
#[test]
fn a_pick_knows_how_often_it_was_expected() {
    each_table(300, |tree, table, length| {
        let (expected, places) = (expectations(table, tree), tree.places(300));
        let mut list = Vec::new();
        for round in 0..20 {
            table.draw(tree, |stratum| f64::from(unit(977 * round + stratum)), &mut list);
            assert_eq!(list.len(), length as usize);
            for pick in &list {
                let truth = expected[pick.light as usize];
                assert!((pick.expected - truth).abs() < 1e-9 * truth, "{pick:?} {truth}");
                assert_eq!(pick.guess, table.guess(tree, places[pick.light as usize]));
                assert!(pick.guess > 0.0 && pick.guess <= 1.0);
            }
        }
    });
}

/// Chi-square test of 20 000 lists against the expected counts, with lights below 5 pooled. Strata make counts more even than
/// independent samples, so the bound for independent samples, at 1e-6, holds all the more.
#[test]
fn lists_hold_lights_as_often_as_expected() {
    let tree = LightTree::new(&lights(200));
    for (phong, length) in [(false, 16), (true, 16), (false, 3)] {
        let table = Table::new(&tree, probes(phong, 7), 40, length, None);
        let expected = expectations(&table, &tree);
        let (mut counts, mut list) = (vec![0.0; 200], Vec::new());
        let lists = 20_000;
        for round in 0..lists {
            table.draw(
                &tree,
                |stratum| f64::from(mix(round * 64 + stratum)) / 4_294_967_296.0,
                &mut list,
            );
            list.iter().for_each(|pick| counts[pick.light as usize] += 1.0);
        }
        let (mut chi2, mut cells, mut pooled) = (0.0, 0, (0.0, 0.0));
        for (count, n) in counts.iter().zip(&expected) {
            let n = n * f64::from(lists);
            if n < 5.0 {
                pooled = (pooled.0 + count, pooled.1 + n);
            } else {
                (chi2, cells) = (chi2 + (count - n) * (count - n) / n, cells + 1);
            }
        }
        if pooled.1 >= 5.0 {
            (chi2, cells) = (chi2 + (pooled.0 - pooled.1).powi(2) / pooled.1, cells + 1);
        }
        // Wilson and Hilferty's approximation of the quantile at 1 - 1e-6, which is 4.75 standard deviations out.
        let k = f64::from(cells);
        let bound = k * (1.0 - 2.0 / (9.0 * k) + 4.75 * (2.0 / (9.0 * k)).sqrt()).powi(3);
        assert!(cells > 10 && chi2 < bound, "{chi2} of {cells} cells, {bound}");
    }
}

#[test]
fn a_light_of_a_million_times_the_power_is_in_every_list_and_few_lights_all_are() {
    let mut emitters = lights(400);
    emitters[123].intensity = 1e10;
    let tree = LightTree::new(&emitters);
    let table = Table::new(&tree, probes(false, 9), 64, 4, None);
    let mut list = Vec::new();
    table.draw(&tree, |_| 0.5, &mut list);
    assert!(list.iter().any(|pick| pick.light == 123 && pick.expected == 1.0));
    assert_eq!(table.always(), 1);
    let tree = LightTree::new(&lights(16));
    let table = Table::new(&tree, probes(false, 9), 64, 16, None);
    assert_eq!((table.always(), table.length()), (16, 16));
}

/// Lights that no point sees are sampled less often, but are sampled.
#[test]
fn looks_move_lists_to_the_lights_that_are_seen() {
    let emitters = lights(500);
    let tree = LightTree::new(&emitters);
    let hidden = |table: &Table| -> f64 {
        let expected = expectations(table, &tree);
        (emitters.iter().zip(&expected))
            .filter(|(e, _)| e.mean[0] > 6.0)
            .map(|(_, n)| n)
            .sum()
    };
    let without = hidden(&Table::new(&tree, probes(false, 3), 300, 16, None));
    let with = hidden(&Table::new(
        &tree,
        probes(false, 3),
        300,
        16,
        Some(&mut Wall(emitters.clone())),
    ));
    assert!(with < 0.4 * without && with > 0.02 * without, "{with} {without}");
}

/// Whether points walk: of a tile whose lobes look at different lights they do, unless most lights are hidden, or there is one lobe, or
/// none.
#[test]
fn points_walk_where_lobes_differ_and_lights_are_visible() {
    /// One of eight lights is visible.
    struct Few;
    impl Look for Few {
        fn reaches(&mut self, light: u32, _: &Probes) -> u32 {
            if mix(light).is_multiple_of(8) { 0xffff } else { 0 }
        }
    }
    let lights = lights(500);
    let tree = LightTree::new(&lights);
    let walked =
        |probes: Probes, look: Option<&mut dyn Look>| Table::new(&tree, probes, 256, 16, look).starts().is_some();
    assert!(walked(probes(true, 1), None));
    assert!(!walked(probes(true, 1), Some(&mut Few)));
    assert!(!walked(probes(false, 1), None));
    let mut one = Probes::new(true);
    for _ in 0..16 {
        one.push([3.0, -1.0, 4.0], [0.0, 1.0, 0.0], [0.6, 0.8, 0.0], 50.0);
    }
    assert!(!walked(one, None));
}

/// Lights that no point sees have strata of their own: how many of them are in a list differs by less than one from what is expected. As
/// many independent choices would differ by 1.2 in one list of three.
#[test]
fn hidden_lights_have_strata_of_their_own() {
    let mut emitters = lights(500);
    // So that each is worth a look.
    for emitter in &mut emitters {
        (emitter.intensity, emitter.emission) = (1.0, Emission::Round);
        emitter.mean[1] += 20.0;
    }
    let tree = LightTree::new(&emitters);
    let mut wall = Wall(emitters.clone());
    let table = Table::new(&tree, probes(false, 3), 500, 16, Some(&mut wall));
    let hidden = |light: u32| emitters[light as usize].mean[0] > 6.0;
    let expected = expectations(&table, &tree);
    let expected: f64 = (0..500).filter(|&i| hidden(i)).map(|i| expected[i as usize]).sum();
    assert!((0.5..4.0).contains(&expected), "{expected}");
    let mut list = Vec::new();
    for round in 0..500 {
        table.draw(&tree, |stratum| f64::from(unit(977 * round + stratum)), &mut list);
        let count = list.iter().filter(|pick| hidden(pick.light)).count() as f64;
        assert!((count - expected).abs() < 1.0, "{count} of {expected}");
    }
}
