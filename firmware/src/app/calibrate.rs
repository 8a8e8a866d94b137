//! The calibration of cogging and friction, started from the console. It runs beside the permanent rows, with its sums in the app's memory.

use super::state::{Activity, CalibrationPhase, Run, State};
use crate::board::{Clock, TICKS_PER_ROW};
use crate::calibration::{CalibrationError, CalibrationResult, CalibrationRun, Map, Trajectory};
use crate::console::errors::{Code, ErrorEntry};
use crate::mailbox::Mailbox;
use crate::speed_loop::{CompensationGains, Config, Mode};
use core::cell::Cell;

/// Waits for a requested calibration, runs it and puts its result in force; runs for ever. It also passes every changed compensation to
/// the speed loop.
pub async fn run<'a, C: Clock>(
    state: &State<'_>,
    clock: &C,
    map: &'a mut Map,
    measuring: &Cell<Option<CalibrationRun<'a>>>,
    compensation: &Mailbox<CompensationGains>,
) -> ! {
    let mut free_map = Some(map);
    loop {
        clock.until(clock.now() + TICKS_PER_ROW).await;
        if state.source.compensation_changed.take()
            && let Ok(config) = Config::new(&state.settings.kept.get().settings, &state.hardware)
        {
            compensation.post(config.compensation());
        }
        if matches!(state.calibration.phase.get(), CalibrationPhase::Requested)
            && let Some(map) = free_map.take()
        {
            let settings = state.settings.kept.get().settings;
            let outcome = match Trajectory::new(&settings) {
                Ok(course) => {
                    state.calibration.phase.set(CalibrationPhase::Starting);
                    measuring.set(Some(CalibrationRun::new(course, map, &settings)));
                    let run =
                        Run { profile: course.profile(), mode: Mode::Rate, rows_left: course.rows(), activity: Activity::Calibration };
                    state.drive.start(run);
                    let end = end_of_course(state, clock, measuring).await;
                    let sums = measuring.take();
                    state.calibration.phase.set(CalibrationPhase::Evaluating);
                    let outcome = match (end, &sums) {
                        (Ok(()), Some(sums)) => sums.evaluate(&settings, &state.hardware).await,
                        (Err(refused), _) => Err(refused),
                        (Ok(()), None) => Err(CalibrationError::Aborted),
                    };
                    free_map = sums.map(CalibrationRun::into_map);
                    outcome
                }
                Err(error) => {
                    free_map = Some(map);
                    state.drive.activity.set(Activity::None);
                    Err(CalibrationError::Settings(error))
                }
            };
            finish(state, outcome);
        }
    }
}

/// Waits until the course is over or was refused.
async fn end_of_course<C: Clock>(
    state: &State<'_>,
    clock: &C,
    measuring: &Cell<Option<CalibrationRun<'_>>>,
) -> Result<(), CalibrationError> {
    loop {
        clock.until(clock.now() + TICKS_PER_ROW).await;
        if let Some(refused) = state.calibration.watch.error() {
            state.drive.end();
            return Err(refused);
        }
        let sums = measuring.take();
        let is_over = sums.as_ref().is_none_or(CalibrationRun::is_over);
        measuring.set(sums);
        if is_over {
            return Ok(());
        }
    }
}

fn finish(state: &State<'_>, outcome: Result<CalibrationResult, CalibrationError>) {
    match &outcome {
        Ok(found) => {
            let mut kept = state.settings.kept.get();
            kept.settings.compensation = found.compensation;
            state.settings.kept.set(kept);
            state.source.compensation_changed.set(true);
        }
        Err(refused) => state.report(ErrorEntry::with(Code::CALIBRATION, refused)),
    }
    state.calibration.phase.set(CalibrationPhase::Finished(outcome));
    state.status.complete_operation();
}
