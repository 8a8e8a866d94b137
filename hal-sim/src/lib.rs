//! The board that is not there.
