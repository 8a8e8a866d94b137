use super::*;
use crate::status::Fault;

fn sample(n: u32) -> Sample {
    Sample { count: EncoderCount(n as u16), duty: -(n as i16), current: CurrentCode(n as i32), rate: n as f32, command: -(n as i32) }
}

/// Ticks `from..to`, with the fault latched from its tick on.
fn run(recorder: &mut Recorder<'_>, from: u32, to: u32, fault: Option<(Fault, u32)>) {
    for n in from..to {
        recorder.record(&sample(n));
        if n % 10 == 3 {
            let latched = fault.filter(|(_, at)| *at <= n).unwrap_or((Fault::None, 0));
            recorder.update(n, latched);
        }
    }
}

#[test]
fn a_recording_contains_every_tick_around_its_fault() {
    let memory = Memory::new();
    let mut recorder = memory.recorder(1_500);
    run(&mut recorder, 0, 10_006, Some((Fault::Stall, 10_001)));
    assert!(memory.record().is_none(), "recording continues after the fault");
    run(&mut recorder, 10_006, 12_000, Some((Fault::Stall, 10_001)));
    let record = memory.record().unwrap();
    assert_eq!((record.len(), record.trigger(), record.fault(), record.trigger_tick()), (SAMPLES, 1_500, Fault::Stall, 10_001));
    for k in 0..SAMPLES {
        assert_eq!(record.sample(k), Some(sample(10_001 - 1_500 + k as u32)), "{k}");
    }
    assert_eq!(record.sample(SAMPLES), None);
}

#[test]
fn a_recording_soon_after_power_on_is_shorter() {
    let memory = Memory::new();
    let mut recorder = memory.recorder(1_500);
    run(&mut recorder, 0, 3_000, Some((Fault::Overspeed, 200)));
    let record = memory.record().unwrap();
    assert_eq!((record.len(), record.trigger()), (200 + SAMPLES - 1_500, 200));
    assert_eq!(record.sample(200), Some(sample(200)));
}

#[test]
fn requests_trigger_and_arm_and_a_cleared_fault_arms() {
    let memory = Memory::new();
    let mut recorder = memory.recorder(100);
    run(&mut recorder, 0, 5_000, None);
    memory.trigger();
    run(&mut recorder, 5_000, 8_000, None);
    let record = memory.record().unwrap();
    assert_eq!((record.fault(), record.trigger(), record.trigger_tick()), (Fault::None, 100, 5_003));
    memory.arm(2_000);
    assert!(memory.record().is_none());
    run(&mut recorder, 8_000, 20_000, Some((Fault::Clock, 15_000)));
    assert_eq!(memory.record().map(|r| (r.trigger(), r.sample(2_000))), Some((2_000, Some(sample(15_000)))));
    run(&mut recorder, 20_000, 21_000, None);
    assert!(memory.record().is_none(), "restarted by the cleared fault");
    run(&mut recorder, 21_000, 30_000, Some((Fault::SupplyLow, 25_000)));
    assert_eq!(memory.record().map(|r| (r.fault(), r.trigger())), Some((Fault::SupplyLow, 2_000)));
}

#[test]
fn a_second_trigger_does_not_change_a_recording() {
    let memory = Memory::new();
    let mut recorder = memory.recorder(1_000);
    run(&mut recorder, 0, 5_100, Some((Fault::Stall, 5_000)));
    memory.trigger();
    run(&mut recorder, 5_100, 9_000, Some((Fault::Stall, 5_000)));
    assert_eq!(memory.record().map(|r| r.trigger_tick()), Some(5_000));
}
