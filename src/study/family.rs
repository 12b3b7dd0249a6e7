//! Families of tests: many tests, one stated chance of a false alarm.

/// Tests that together raise a false alarm with a probability of `alpha` at most.
///
/// The family counts its own members, and says how rare a false alarm must be for each only when it takes no more
/// ([`Self::close`]): a share can then not be that of another number of tests. Each gets `alpha / n` (Boole's
/// inequality), which needs no assumption about how the tests depend on each other. Šidák's share for independent ones
/// is larger by a factor of `1 + alpha / 2` at most.
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

    /// A family of these members, a test each.
    pub fn of(alpha: f64, members: impl IntoIterator<Item = T>) -> Self {
        let mut family = Self::new(alpha);
        members.into_iter().for_each(|member| family.add(member));
        family
    }

    /// Takes in a test.
    pub fn add(&mut self, member: T) {
        self.add_several(1, member);
    }

    /// Takes in a member that makes up to so many tests.
    pub fn add_several(&mut self, tests: usize, member: T) {
        self.tests += tests;
        self.members.push(member);
    }

    /// The probability of a false alarm that each test may have, and the members, in order. `alpha` itself for a family
    /// without tests, which raises no alarm.
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
