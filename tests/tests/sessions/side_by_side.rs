//! Many stands in one process: each gives the result of a stand alone.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{Record, SessionRequest, run};
use rayon::prelude::*;
use stand_acquire::hidden;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

/// The stand of this number, with its own hidden effect, mode, profile and noise.
fn stand(seed: u64) -> Record {
    let mut stand = Stand::default();
    hidden::hide(&seed.to_string(), &mut stand).unwrap();
    let mode = if seed.is_multiple_of(2) { Mode::Rate } else { Mode::Voltage };
    // The last profile counts turns and has no voltage form.
    let kind = ProfileKind::ALL[(seed / 2) as usize % (ProfileKind::ALL.len() - 1)];
    run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), SessionRequest::new(mode, kind, 0.5, seed)).unwrap()
}

/// All numbers of a record as bits, so that −0 differs from 0.
fn bits(record: &Record) -> Vec<u64> {
    let truth = record.true_theta_rad.iter().chain(&record.true_omega_rad_s);
    record.columns.iter().flat_map(|(_, values)| values).chain(truth).map(|v| v.to_bits()).collect()
}

#[test]
fn hundred_parallel_stands_are_bit_identical_to_single_ones() {
    let alone: Vec<Record> = (0..100).map(stand).collect();
    // More threads than cores, so that the stands interleave.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
    let together: Vec<Record> = pool.install(|| (0..100).into_par_iter().map(stand).collect());
    for (seed, (one, other)) in alone.iter().zip(&together).enumerate() {
        assert_eq!(bits(one), bits(other), "stand {seed}");
        assert_eq!(one, other, "stand {seed}: notes, limits, faults, pace");
    }
    for (a, one) in alone.iter().enumerate() {
        assert!(alone[..a].iter().all(|other| bits(other) != bits(one)), "stand {a} differs from the previous ones");
    }
}
