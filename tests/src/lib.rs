//! Whole sessions: firmware and tools together, on the simulated stand.
