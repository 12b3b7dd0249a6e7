//! Families of tests: many tests with one stated probability of a false alarm.

/// Tests that together raise a false alarm with a probability of `alpha` at most.
///
/// The family counts its own members and returns the false-alarm rate per test only when it is closed ([`Self::close`]), so the
/// rate always matches the number of tests. Each gets `alpha / n` (Boole's inequality), which holds for any dependence between
/// the tests. Šidák's correction for independent tests is larger by a factor of `1 + alpha / 2` at most.
#[derive(Clone, Debug)]
pub struct Family<T> {
    alpha: f64,
    members: Vec<T>,
    tests: usize,
}

impl<T> Family<T> {
    /// A family without members.
    ///
    /// # Panics
    /// Unless `alpha` is above 0 and below 1.
    pub fn new(alpha: f64) -> Self {
        assert!(alpha > 0.0 && alpha < 1.0, "a probability of false alarms of {alpha}");
        Self {
            alpha,
            members: Vec::new(),
            tests: 0,
        }
    }

    /// A family of these members, one test each.
    pub fn of(alpha: f64, members: impl IntoIterator<Item = T>) -> Self {
        let mut family = Self::new(alpha);
        members.into_iter().for_each(|member| family.add(member));
        family
    }

    /// Adds a test.
    pub fn add(&mut self, member: T) {
        self.add_several(1, member);
    }

    /// Adds a member that makes up to so many tests.
    pub fn add_several(&mut self, tests: usize, member: T) {
        self.tests += tests;
        self.members.push(member);
    }

    /// The false-alarm probability of each test, and the members in order. `alpha` itself for an empty family, which raises no
    /// alarm.
    pub fn close(self) -> (f64, Vec<T>) {
        (self.alpha / self.tests.max(1) as f64, self.members)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_follows_from_the_members() {
        let mut family = Family::of(0.01, ["a", "b"]);
        family.add("c");
        family.add_several(7, "d");
        let (each, members) = family.close();
        assert!((each - 0.001).abs() < 1e-18);
        assert_eq!(members, ["a", "b", "c", "d"]);
        assert_eq!(Family::<()>::new(0.01).close(), (0.01, vec![]));
    }
}
