//! When the next look is taken: looks may cost a fixed share of the threads' time on any processor.
//!
//! The first looks follow each other at once, on credit. After the first second a look is taken when what all looks have cost is
//! paid: when it is less than their share of the time that the threads have rendered.

use std::fs;
use std::time::Duration;

/// Minimum interval of looks.
pub const SHORTEST: Duration = Duration::from_millis(100);

/// Maximum interval of looks that are paid. Later changes of a picture are hardly visible.
const LONGEST: Duration = Duration::from_millis(500);

/// Minimum interval of looks at a race, which shows several pictures and measures their errors.
const RACE_SHORTEST: Duration = Duration::from_millis(250);

/// Looks younger than this are taken on credit.
const YOUNG: Duration = Duration::from_secs(1);

/// Ratio of a picture's age and the interval of looks on credit: the noise of a picture shrinks visibly by a factor of time, so
/// half a dozen looks show the first second.
const YOUNG_LOOKS: u32 = 3;

/// The same ratio after that.
const LOOKS: u32 = 20;

/// The share of the threads' time that looks at a picture may take. The program measures its own part of a look; caches that a look
/// empties and a reader on the same machine come on top, and all of it has to stay below 3 %.
const SHARE: f64 = 0.016;

/// The same for a race. Its racers have had equal time whatever looks cost, and its curves are what it is for.
const RACE_SHARE: f64 = 0.1;

/// The pace of looks at one picture or race.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// The share of the threads' time for looks.
    share: f64,
    shortest: Duration,
    /// What looks had cost before this picture.
    before: Duration,
    /// The age at the last look.
    looked: Option<Duration>,
}

impl Pace {
    /// The pace of a new picture or race; `spent` is the time of threads that looks have taken so far, at whatever picture.
    pub fn new(race: bool, spent: Duration) -> Self {
        let (share, shortest) = if race {
            (RACE_SHARE, RACE_SHORTEST)
        } else {
            (SHARE, SHORTEST)
        };
        Self {
            share,
            shortest,
            before: spent,
            looked: None,
        }
    }

    /// Whether no look was taken yet.
    pub fn is_first(&self) -> bool {
        self.looked.is_none()
    }

    /// A look is taken at this age.
    pub fn look(&mut self, age: Duration) {
        self.looked = Some(age);
    }

    /// Whether a look is due at the age of `age`, the time for which `threads` have rendered this picture; looks at all pictures have
    /// taken `spent` of the time of threads.
    pub fn is_due(&self, age: Duration, threads: u32, spent: Duration) -> bool {
        let Some(looked) = self.looked else {
            return true;
        };
        let waited = age.saturating_sub(looked);
        if age < YOUNG {
            return waited >= (age / YOUNG_LOOKS).max(self.shortest);
        }
        let cost = spent.saturating_sub(self.before).as_secs_f64();
        let interval = (age / LOOKS).clamp(self.shortest, LONGEST);
        waited >= interval && cost <= self.share * age.as_secs_f64() * f64::from(threads)
    }
}

/// Measures what a thread takes of a processor. A look's own time on a clock would charge it for what other programs take.
#[derive(Debug, Default)]
pub struct Meter {
    last: Duration,
}

impl Meter {
    /// What this thread took since the last call from it; `clock` where the system does not tell. The kernel counts at its ticks and when
    /// a thread sleeps, so a single lap is coarse and their sum is not.
    pub fn lap(&mut self, clock: Duration) -> Duration {
        let told = fs::read_to_string("/proc/thread-self/schedstat").ok();
        let Some(now) = told.and_then(|text| text.split(' ').next()?.parse().ok()) else {
            return clock;
        };
        let now = Duration::from_nanos(now);
        let lap = now.saturating_sub(self.last);
        self.last = now;
        lap
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    const STEP: Duration = Duration::from_millis(20);

    /// The ages of the looks at a picture whose looks cost so many milliseconds of threads, after steps of 20 ms.
    fn looks(race: bool, cost: u64, threads: u32, until: Duration) -> Vec<Duration> {
        let (mut spent, mut age, mut looks) = (Duration::from_secs(77), Duration::ZERO, Vec::new());
        let mut pace = Pace::new(race, spent);
        while age < until {
            age += STEP;
            if pace.is_due(age, threads, spent) {
                pace.look(age);
                looks.push(age);
                spent += Duration::from_millis(cost);
            }
        }
        looks
    }

    #[test]
    fn looks_cost_at_most_their_share_of_the_time_of_all_threads_and_one_look_more() {
        for threads in [1, 2, 64] {
            for cost in [0, 1, 10, 100, 3000] {
                for (race, share) in [(false, SHARE), (true, RACE_SHARE)] {
                    let all = looks(race, cost, threads, Duration::from_secs(100));
                    for (before, &age) in all.iter().enumerate().filter(|(_, age)| **age >= YOUNG) {
                        let paid = cost as f64 * 1e-3 * before as f64;
                        let may = share * age.as_secs_f64() * f64::from(threads);
                        assert!(
                            paid <= may + 1e-9,
                            "{cost} ms, {threads} threads: {paid} s of {may} s at {age:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_first_second_shows_six_looks_whatever_they_cost() {
        for cost in [0, 10, 1000] {
            let young = looks(false, cost, 2, YOUNG - STEP);
            assert_eq!(young.len(), 6, "{cost} ms: {young:?}");
            assert!(young[0] == STEP && young[1] <= STEP + SHORTEST);
        }
    }

    #[test]
    fn looks_that_cost_nothing_come_ten_and_later_two_times_a_second() {
        let all = looks(false, 0, 1, Duration::from_secs(20));
        let between = |from, to| all.iter().filter(|age| (from..to).contains(&age.as_secs())).count();
        assert_eq!(between(1, 2), 10);
        assert_eq!(between(15, 20), 10);
    }

    #[test]
    fn the_laps_of_a_thread_add_up_to_its_work() {
        let mut meter = Meter::default();
        meter.lap(Duration::ZERO);
        let (begun, mut laps) = (Instant::now(), Duration::ZERO);
        while begun.elapsed() < Duration::from_millis(40) {
            laps += meter.lap(Duration::from_nanos(1));
        }
        std::thread::sleep(Duration::from_millis(1));
        laps += meter.lap(Duration::from_nanos(1));
        // What the kernel had not counted at the first call is at most a few ticks.
        assert!(
            laps > Duration::ZERO && laps <= begun.elapsed() + Duration::from_millis(20),
            "{laps:?}"
        );
    }

    #[test]
    fn a_dear_look_is_paid_before_the_next_one() {
        // 60 ms on credit in the first second are 1.875 s of two threads at 1.6 %.
        let all = looks(false, 10, 2, Duration::from_secs(10));
        let first = all.iter().find(|age| **age >= YOUNG).unwrap();
        assert_eq!(first.as_millis(), 1880);
    }
}
