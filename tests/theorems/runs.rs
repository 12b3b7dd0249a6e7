//! A run ends: at its goal or by a stop. What it renders does not depend on steps, pauses, looks or on being taken up again.

use std::cell::Cell;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::proof::pictures::assert_same;
use crate::proof::runs::{load, settings};
use octolux::pipeline::{Prepared, Progress, Settings};
use octolux::run::{Goal, Observer, RenderError, RenderOptions, ResumeError, Run, Saved, Shard, Step};
use octolux::scene::{EstimatorKind, FilmSize, Scene};
use octolux::settings::Lanes;

fn scene() -> Scene {
    load("tests/two-lights.toml")
}

fn prepared(width: u32, height: u32) -> Prepared {
    Prepared::new(&scene(), settings(width, height, EstimatorKind::Mis)).expect("it renders")
}

/// Stops after so many looks.
struct StopAfter(Cell<u32>);

impl Observer for StopAfter {
    fn stopped(&self) -> bool {
        self.0.get() == 0
    }

    fn next_look(&self) -> Option<Instant> {
        Some(Instant::now())
    }

    fn look(&self, _: &Run) {
        self.0.set(self.0.get().saturating_sub(1));
    }
}

#[test]
fn a_run_that_was_stopped_ends_whatever_its_goal() {
    let prepared = prepared(48, 32);
    for goal in [
        Goal::passes(1 << 20),
        Goal::adaptive(1 << 20),
        Goal::error(1e-9),
        Goal::time(Duration::from_secs(1 << 20)),
        Goal::shard(Shard { number: 2, of: 2 }, 1 << 20),
    ] {
        let mut run = prepared.start(goal);
        assert_eq!(run.run(&StopAfter(Cell::new(3))), Step::Stopped, "{goal:?}");
        let (samples, picture) = (run.counters().samples, run.picture());
        // The loop that spun: there is no progress any more, and so there are no steps.
        let steps = (0..10).take_while(|_| run.step().is_more()).count();
        assert_eq!(steps, 0, "{goal:?}");
        run.extend(1 << 21);
        assert_eq!(run.step(), Step::Stopped, "{goal:?}: a stop is for good");
        assert_eq!(run.counters().samples, samples);
        assert_same("stopped", &run.picture(), &picture);
        assert!(!run.is_complete());
    }
}

#[test]
fn a_stop_from_another_thread_ends_a_run() {
    struct Elsewhere;
    impl Observer for Elsewhere {
        fn begins(&self, progress: &Arc<Progress>) {
            let progress = progress.clone();
            std::thread::spawn(move || progress.request_stop());
        }
    }
    let mut run = prepared(48, 32).passes(1 << 30);
    assert_eq!(run.run(&Elsewhere), Step::Stopped);
}

#[test]
fn a_pause_that_is_long_over_still_lets_every_run_end() {
    let prepared = prepared(48, 32);
    for goal in [Goal::passes(6), Goal::adaptive(12), Goal::error(2.0)] {
        let mut hurried = prepared.start(goal);
        let steps = (0..10_000)
            .take_while(|_| hurried.step_until(Some(Instant::now())).is_more())
            .count();
        assert!(10 < steps && hurried.is_complete(), "{goal:?}: {steps} steps");
        assert_same("hurried", &hurried.picture(), &prepared.start(goal).finish().picture());
    }
}

#[test]
fn a_run_with_a_time_ends_by_it_and_has_a_sample_at_least() {
    let prepared = prepared(16, 16);
    for goal in [Goal::passes(1 << 30), Goal::adaptive(1 << 20), Goal::error(1e-9)] {
        let run = prepared.start(goal.within(Duration::from_nanos(1))).finish();
        assert!(run.is_complete() && run.spread().0 >= 1, "{goal:?}");
    }
    let second = Duration::from_secs(1);
    assert_eq!(*prepared.for_time(second).goal(), Goal::time(second));
    assert_eq!(*prepared.until_error(0.5).goal(), Goal::error(0.5));
}

#[test]
fn a_resumed_run_to_an_error_expects_no_sample_twice() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.state");
    let prepared = prepared(33, 20);
    for goal in [Goal::error(0.005), Goal::adaptive_error(0.005)] {
        let mut run = prepared.start(goal);
        // To the middle: both halves have decided on more than the first pictures.
        let pixels = 33 * 20;
        while run.progress().samples() < 200 * pixels {
            assert!(run.step().is_more(), "{goal:?}: the goal is too near for this test");
        }
        run.save(&path, Vec::new()).expect("it is saved");
        let resumed = prepared.resume(goal, Saved::read(&path).expect("it is read"));
        let resumed = resumed.expect("it goes on");
        let [of_run, of_resumed] = [&run, &resumed].map(|run| (run.progress().samples(), run.progress().expected()));
        // Between looks an adaptive run does not count the films that it has discarded since the last one.
        assert!(
            of_resumed == of_run || goal.is_adaptive(),
            "{goal:?}: {of_resumed:?}, {of_run:?}"
        );
        let (run, resumed) = (run.finish(), resumed.finish());
        assert_same("resumed", &resumed.picture(), &run.picture());
        let [of_run, of_resumed] = [&run, &resumed].map(|run| (run.progress().samples(), run.progress().expected()));
        assert_eq!(of_resumed, of_run, "{goal:?}, at the end");
    }
}

#[test]
fn more_samples_can_be_added_to_a_run_that_is_done() {
    let prepared = prepared(33, 20);
    let mut run = prepared.passes(0);
    assert_eq!(run.step(), Step::Done);
    for looked_at in [1, 8, 64] {
        run.extend(looked_at);
        assert_eq!(run.run(&()), Step::Done);
        assert_eq!(run.passes(), looked_at);
    }
    assert_same("extended", &run.picture(), &prepared.passes(64).finish().picture());
}

#[test]
fn a_saved_run_goes_on_with_the_same_bits_and_no_other_takes_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.acc");
    let prepared = prepared(33, 20);
    let mut first = prepared.passes(40);
    let _ = first.run(&StopAfter(Cell::new(9)));
    first.save(&path, Vec::new()).expect("it is written");
    let saved = || Saved::read(&path).expect("it is read");
    let resumed = prepared.resume(Goal::passes(40), saved()).expect("it goes on");
    assert!(resumed.passes() < 40 && resumed.counters() == first.counters());
    assert_same(
        "resumed",
        &resumed.finish().picture(),
        &prepared.passes(40).finish().picture(),
    );

    let other = prepared.with_seed(9).resume(Goal::passes(40), saved());
    let other = other.expect_err("another seed");
    assert_eq!(
        other.to_string(),
        "belongs to another render: seed is 1 here and 9 there"
    );
    let other = prepared.resume(Goal::passes(39), saved()).expect_err("fewer samples");
    assert_eq!(
        other.to_string(),
        "belongs to another render: samples a pixel is 40 here and 39 there"
    );
    let shard = Goal::shard(Shard { number: 1, of: 2 }, 40);
    let other = prepared.resume(shard, saved()).expect_err("a shard");
    assert_eq!(other, ResumeError::OtherShard);
    let adaptive = prepared.resume(Goal::adaptive(40), saved()).expect_err("another way");
    assert!(
        adaptive
            .to_string()
            .contains("adaptive is no here and 40 samples a pixel there"),
        "{adaptive}"
    );
}

/// The bits are those of a run in one piece where the first goal ends a block, as 32 does, and else those of `extend`.
#[test]
fn a_saved_run_goes_on_to_more_samples_than_it_was_to_have() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.acc");
    let prepared = prepared(33, 20);
    for (first, more, stopped) in [(32, 70, true), (32, 33, false), (40, 64, true), (40, 100, false)] {
        let mut run = prepared.passes(first);
        if stopped {
            let _ = run.run(&StopAfter(Cell::new(5)));
        } else {
            let _ = run.run(&());
        }
        run.save(&path, Vec::new()).expect("it is written");
        let saved = Saved::read(&path).expect("it is read");
        let resumed = prepared.resume(Goal::passes(more), saved).expect("it goes on").finish();
        assert_eq!(
            (resumed.passes(), resumed.is_complete()),
            (more, true),
            "{first} to {more}"
        );
        let mut expected = prepared.passes(first).finish();
        expected.extend(more);
        let _ = expected.run(&());
        assert_same("extended", &resumed.picture(), &expected.picture());
        if first == 32 {
            assert_same(
                "in one piece",
                &resumed.picture(),
                &prepared.passes(more).finish().picture(),
            );
        }
    }
}

#[test]
fn other_settings_share_what_was_built_and_give_the_bits_of_a_fresh_start() {
    let scene = scene();
    let base = settings(33, 20, EstimatorKind::Mis);
    let prepared = Prepared::new(&scene, base).expect("it renders");
    for estimator in EstimatorKind::ALL {
        let settings = Settings {
            estimator,
            lanes: Some(Lanes::One),
            seed: 7,
            ..base
        };
        let turned = prepared.with_settings(settings).expect("nothing is to be built");
        let fresh = Prepared::new(&scene, settings).expect("it renders");
        assert_same(
            "turned",
            &turned.passes(5).finish().picture(),
            &fresh.passes(5).finish().picture(),
        );
        assert_eq!((turned.kernel(), turned.why()), (fresh.kernel(), fresh.why()));
    }
    let wider = Settings {
        film: FilmSize { width: 34, height: 20 },
        ..base
    };
    assert!(prepared.with_settings(wider).is_err());
}

#[test]
fn numbers_out_of_range_are_refused_with_what_would_do() {
    let refused = |options: RenderOptions| match octolux::render(&scene(), &options) {
        Err(RenderError::Options(what)) => what,
        other => panic!("{other:?}"),
    };
    let spp = RenderOptions {
        spp: 0,
        ..Default::default()
    };
    assert_eq!(refused(spp), "spp is 0, and goes from 1 to 1073741824");
    let size = Some(FilmSize { width: 0, height: 9 });
    let size = RenderOptions {
        size,
        ..Default::default()
    };
    assert_eq!(refused(size), "size is 0 x 9, and sides go from 1 to 65536");
    for error in [f64::NAN, 0.0, -1.0] {
        let options = RenderOptions {
            target_error: Some(error),
            ..Default::default()
        };
        assert!(refused(options).starts_with("target_error is "));
    }
}
