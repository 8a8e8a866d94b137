//! What a person at the stand uses on the host.
