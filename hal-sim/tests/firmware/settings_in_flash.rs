//! Settings in flash over power cuts: the old or the new record is found, never none and never another.

#![allow(clippy::unwrap_used)]

use hal_sim::peripherals::flash::{SMALL_SECTOR_BYTES, SimFlash};
use stand_firmware::settings::store::{SLOT_BYTES, Store};
use stand_firmware::settings::{Kept, StoreError};

const SECTOR: u32 = SMALL_SECTOR_BYTES as u32;
const SLOTS: usize = SMALL_SECTOR_BYTES / SLOT_BYTES;

fn store(flash: SimFlash) -> Store<SimFlash> {
    Store::new(flash, [0, SECTOR], SECTOR)
}

fn flash(seed: u64) -> SimFlash {
    SimFlash::new(&[SMALL_SECTOR_BYTES; 2], seed)
}

fn kept(n: usize) -> Kept {
    let mut kept = Kept::default();
    kept.settings.inertia_kg_m2 = n as f64 * 1e-6;
    kept
}

fn number(kept: Option<Kept>) -> Option<usize> {
    kept.map(|kept| (kept.settings.inertia_kg_m2 * 1e6).round() as usize)
}

fn load(store: &mut Store<SimFlash>) -> Option<usize> {
    number(store.load(Kept::layout()).unwrap())
}

#[test]
fn the_newest_of_many_is_found_over_both_sectors() {
    let mut store = store(flash(1));
    assert_eq!(load(&mut store), None);
    for n in 1..=3 * SLOTS + 2 {
        store.save(&kept(n), Kept::layout()).unwrap();
        assert_eq!(load(&mut store), Some(n));
    }
    let erases = store.flash().erases();
    assert_eq!(erases, [1, 1], "a sector is erased once in {SLOTS} records");
}

/// Each step of each save, including the change of sector, with three different incomplete results.
#[test]
fn a_power_cut_at_any_write_leaves_the_old_or_the_new() {
    let mut whole = store(flash(2));
    let mut cuts = 0;
    // Enough saves to erase and reuse both sectors.
    for n in 1..=2 * SLOTS + 3 {
        let before = whole.flash().clone();
        whole.save(&kept(n), Kept::layout()).unwrap();
        let steps = whole.flash().steps() - before.steps();
        // All steps where the sector changes and in the first slots; a few where it is always the same.
        let every = if n % SLOTS <= 2 { 1 } else { 17 };
        for step in (0..steps).step_by(every) {
            for ruin in 0..3 {
                let mut flash = SimFlash::new(&[SMALL_SECTOR_BYTES; 2], 1000 * ruin + step);
                flash.load(before.bytes());
                flash.cut_after(step);
                let mut store = store(flash);
                assert_eq!(store.save(&kept(n), Kept::layout()), Err(StoreError::Flash));
                store.flash().power_on();
                let found = load(&mut store);
                let old = (n > 1).then_some(n - 1);
                assert!(found == old || found == Some(n), "save {n} cut at step {step} of {steps}: {found:?}");
                // The incomplete record does not prevent the next save.
                store.save(&kept(n + 500), Kept::layout()).unwrap();
                assert_eq!(load(&mut store), Some(n + 500));
                cuts += 1;
            }
        }
    }
    assert!(cuts > 1000, "{cuts}");
}

#[test]
fn a_flipped_bit_is_detected_and_the_previous_record_is_used() {
    let mut store = store(flash(3));
    store.save(&kept(1), Kept::layout()).unwrap();
    store.save(&kept(2), Kept::layout()).unwrap();
    let good = store.flash().bytes().to_vec();
    let length = u32::from_le_bytes(good[SLOT_BYTES..SLOT_BYTES + 4].try_into().unwrap()) as usize;
    for byte in 0..length {
        let mut bad = good.clone();
        bad[SLOT_BYTES + byte] ^= 1 << (byte % 8);
        store.flash().load(&bad);
        assert_eq!(load(&mut store), Some(1), "byte {byte}");
    }
}

#[test]
fn a_record_of_another_firmware_is_not_read() {
    let mut store = store(flash(4));
    store.save(&kept(1), !Kept::layout()).unwrap();
    assert_eq!(store.load::<Kept>(Kept::layout()), Err(StoreError::OtherLayout));
    store.save(&kept(2), Kept::layout()).unwrap();
    assert_eq!(load(&mut store), Some(2));
}
