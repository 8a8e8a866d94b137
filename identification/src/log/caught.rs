//! Turns a panic of a library that reads a damaged file into an error.

use std::cell::Cell;
use std::panic;
use std::sync::Once;

thread_local! {
    /// A panic of this thread is about to become an error.
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// The result of `read`; `None` if it panics, without the message on standard error that a panic writes otherwise.
pub(in crate::log) fn caught<T>(read: impl FnOnce() -> T) -> Option<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_CAUGHT.get() {
                usual(info);
            }
        }));
    });
    IS_CAUGHT.set(true);
    let result = panic::catch_unwind(panic::AssertUnwindSafe(read)).ok();
    IS_CAUGHT.set(false);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panic_of_the_reader_becomes_none() {
        let numbers = [1.0];
        let index = numbers.len();
        assert_eq!(caught(|| numbers[index]), None);
        assert_eq!(caught(|| numbers[0]), Some(1.0));
        assert!(!IS_CAUGHT.get(), "a panic after it is reported as usual");
    }
}
