//! The virtual instrument: a page on this computer that shows a stand, drives it and runs the loop of identification.
//!
//! In: a port with a stand, a folder. Out: a server on the loopback interface. The threads: [`line`] owns the serial line and every stop;
//! [`jobs`] runs what takes seconds; the rest is asynchronous and never waits for either. The page is in `stand-panel/page/`.
//!
//! Three dead-man switches end a motion: the page's lease ([`control`], 1 s, fed by animation frames); the firmware's supervision of the
//! host (0.5 s, fed by the line's thread while the lease holds); and the end of the line itself, which the firmware sees in the same way.

mod analysis;
mod api;
mod assets;
mod compensation;
mod connection;
mod control;
mod export;
mod hub;
mod import;
mod jobs;
mod laboratory;
mod line;
mod lock;
mod measure;
mod measure_routes;
mod parts;
mod recording;
mod request;
mod security;
mod server;
mod session;
mod socket;
mod stage;
mod stream;
#[cfg(test)]
mod texts;

use std::path::Path;
use std::sync::{Arc, Mutex};

use hub::{Hub, HubObserver};
use jobs::Jobs;
use line::Line;
use parts::Panel;
use server::Server;
use session::Session;
use stand_acquire::link::LinkError;

pub use session::SessionError;

/// Why there is no panel.
#[derive(Debug, thiserror::Error)]
pub enum PanelError {
    /// The port of the server.
    #[error("127.0.0.1:{port}: cannot listen: {source}")]
    Listen {
        /// The port.
        port: u16,
        /// Cause.
        source: std::io::Error,
    },
    /// The line to the stand.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The folder.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The server failed.
    #[error("the server has failed: {0}")]
    Serve(std::io::Error),
}

/// Serves a panel for the stand at `port` until `ends` is true. `ready` receives the address of the page, with its token.
///
/// # Errors
/// The port, the folder or the server.
pub fn serve(port: &Path, folder: &Path, listen: u16, ready: impl FnOnce(&str), ends: impl Fn() -> bool) -> Result<(), PanelError> {
    let server = Server::bind(listen).map_err(|source| PanelError::Listen { port: listen, source })?;
    let session = Arc::new(Session::open(folder)?);
    let hub = Arc::new(Hub::default());
    let (line, thread) = Line::open(port, Box::new(HubObserver(hub.clone())))?;
    let jobs = Jobs::new({
        let hub = hub.clone();
        move |state| hub.set_job(state)
    });
    let streaming = stream::keep(line.clone(), jobs.clone());
    let gate = server.gate();
    let panel = Arc::new(Panel {
        line: line.clone(),
        hub,
        session,
        jobs,
        gate,
        next_client: 1.into(),
        clients: 0.into(),
        presses: Mutex::default(),
    });
    ready(&server.address().map_err(PanelError::Serve)?);
    let served = server.serve(panel, ends);
    streaming.end();
    line.close();
    // A thread that panicked has reported it.
    let _ = thread.join();
    served.map_err(PanelError::Serve)
}
