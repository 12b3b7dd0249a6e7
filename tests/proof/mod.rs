//! What the proof is made of: statistics, families of tests with one verdict, and renders of whole scenes.
//!
//! Every statistical test belongs to a [`Family`] that raises a false alarm with probability [`ALPHA`]; there are fewer
//! than 60 families, so the whole suite stays below 1.2e-3. Seeds are fixed: what passes once passes for good.
#![allow(dead_code)] // each test program uses its own share

pub mod accelerators;
pub mod agreement;
pub mod albedos;
pub mod caps;
pub mod closed_forms;
pub mod combinations;
pub mod costs;
pub mod environments;
pub mod ggx;
pub mod lanes;
pub mod many_lights;
pub mod pictures;
pub mod places;
pub mod rings;
pub mod runs;
pub mod samplers;
pub mod stats;
pub mod strategies;
pub mod triangles;
pub mod weights;

use std::fmt::Write;
use std::path::PathBuf;

use octolux::study::family;

/// How likely one family of tests fails by chance alone, unless it says a smaller chance.
pub const ALPHA: f64 = 2e-5;

/// Tests that are judged together, and the table that they leave behind.
pub struct Family {
    name: &'static str,
    rows: family::Family<(f64, String)>,
}

impl Family {
    /// A family without tests; its table will be called `name`.
    pub fn new(name: &'static str) -> Self {
        Self::rarely(name, ALPHA)
    }

    /// As [`Self::new`], with a false alarm as rare as this.
    pub fn rarely(name: &'static str, alpha: f64) -> Self {
        Self {
            name,
            rows: family::Family::new(alpha),
        }
    }

    /// Takes in a test: how likely chance explains it, and what it was.
    pub fn add(&mut self, p: f64, what: String) {
        self.rows.add((if p.is_nan() { 0.0 } else { p }, what));
    }

    /// Writes the table, worst rows first, and panics with its name if any row is beyond chance.
    pub fn judge(self) {
        let name = self.name;
        let (least, mut rows) = self.rows.close();
        assert!(!rows.is_empty(), "{name}: a family without tests proves nothing");
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut table = format!("# {} tests, rejected below p = {least:.2e}\n", rows.len());
        for (p, what) in &rows {
            let _ = writeln!(table, "{}\t{p:.3e}\t{what}", if *p < least { "REJECTED" } else { "ok" });
        }
        let path = artefact(&format!("{name}.tsv"));
        std::fs::write(&path, &table).expect("a table can be written to the target folder");
        let rejected = rows.iter().filter(|(p, _)| *p < least).count();
        assert!(
            rejected == 0,
            "{name}: {rejected} of {} tests rejected, table in {}; the worst: {}",
            rows.len(),
            path.display(),
            rows[0].1
        );
    }
}

/// Where a test leaves what there is to look at.
pub fn artefact(name: &str) -> PathBuf {
    // Unit tests have no folder of their own. A mutant (`src/mutant.rs`) leaves its tables apart.
    let target = option_env!("CARGO_TARGET_TMPDIR").map_or_else(std::env::temp_dir, PathBuf::from);
    let mutant = std::env::var("OCTOLUX_MUTANT").unwrap_or_default();
    let folder = target.join("proof").join(mutant);
    std::fs::create_dir_all(&folder).expect("the target folder can be written to");
    folder.join(name)
}
