//! Many stands in one process: each is what it is alone.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{Record, SessionRequest, run};
use host_tools::acquire::hidden;
use rayon::prelude::*;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

/// The stand of this number: its own hidden effect, mode, profile and noise.
fn stand(seed: u64) -> Record {
    let mut stand = Stand::default();
    hidden::hide(&seed.to_string(), &mut stand).unwrap();
    let mode = if seed.is_multiple_of(2) { Mode::Rate } else { Mode::Voltage };
    // The last counts turns and has no meaning as a voltage.
    let kind = ProfileKind::ALL[(seed / 2) as usize % (ProfileKind::ALL.len() - 1)];
    run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), SessionRequest::new(mode, kind, 0.5, seed)).unwrap()
}

/// Every number of a record by its bits, so that not even −0 passes for 0.
fn bits(record: &Record) -> Vec<u64> {
    let truth = record.true_theta_rad.iter().chain(&record.true_omega_rad_s);
    record.columns.iter().flat_map(|(_, values)| values).chain(truth).map(|v| v.to_bits()).collect()
}

#[test]
fn a_hundred_stands_side_by_side_are_bit_for_bit_what_each_is_alone() {
    let alone: Vec<Record> = (0..100).map(stand).collect();
    // More threads than cores: their turns mix.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(8).build().unwrap();
    let together: Vec<Record> = pool.install(|| (0..100).into_par_iter().map(stand).collect());
    for (seed, (one, other)) in alone.iter().zip(&together).enumerate() {
        assert_eq!(bits(one), bits(other), "stand {seed}");
        assert_eq!(one, other, "stand {seed}: notes, limits, faults, pace");
    }
    for (a, one) in alone.iter().enumerate() {
        assert!(alone[..a].iter().all(|other| bits(other) != bits(one)), "stand {a} is another than those before");
    }
}
