//! Settings in flash: the supply is cut at every word write and every sector erase.
#![allow(clippy::unwrap_used)]

use hal_sim::controller::flash;
use hal_sim::peripherals::SimFlash;
use hal_sim::peripherals::flash::SMALL_SECTOR_BYTES;
use stand_firmware::settings::{Kept, Store};

fn store(flash: &mut SimFlash) -> Store<&mut SimFlash> {
    let sector = SMALL_SECTOR_BYTES as u32;
    Store::new(flash, [0, sector], sector)
}

fn load(flash: &mut SimFlash) -> Option<Kept> {
    store(flash).load(Kept::layout()).unwrap()
}

/// Settings identified by a number.
fn kept(number: u32) -> Kept {
    let mut kept = Kept::default();
    kept.settings.slip_rad = 0.05 + 1e-4 * f64::from(number);
    kept
}

/// Saves until both sectors have been full and erased; at each save, cuts the supply at each of its steps.
#[test]
fn cut_at_any_write_leaves_old_or_new_settings_and_the_next_save_works() {
    let mut life = flash(1);
    let (mut cuts, mut saves) = (0, 0);
    while life.erases().iter().any(|erases| *erases < 2) {
        saves += 1;
        let (old, new, next) = (load(&mut life), kept(saves), kept(1000 + saves));
        let mut steps = 0;
        loop {
            let mut cut = life.clone();
            cut.cut_after(steps);
            let whole = store(&mut cut).save(&new, Kept::layout()).is_ok();
            cut.power_on();
            let found = load(&mut cut);
            if whole {
                assert_eq!(found, Some(new));
                break;
            }
            cuts += 1;
            // The last word of a record may be complete before the supply fails.
            assert!(found == old || found == Some(new), "save {saves}, cut at step {steps}: {found:?}");
            // Saves again with a cut at the same step, then without a cut.
            cut.cut_after(steps);
            let _ = store(&mut cut).save(&new, Kept::layout());
            cut.power_on();
            let found = load(&mut cut);
            assert!(found == old || found == Some(new), "save {saves}, cut twice at step {steps}: {found:?}");
            store(&mut cut).save(&next, Kept::layout()).unwrap();
            assert_eq!(load(&mut cut), Some(next), "save {saves}, after two cuts at step {steps}");
            steps += 1;
        }
        store(&mut life).save(&new, Kept::layout()).unwrap();
    }
    println!("{cuts} cuts in {saves} saves; erased {:?}", life.erases());
    assert!(cuts > 1000 && saves > 32);
}
