//! The WebSocket of a page: binary messages only.
//!
//! From the page: first the token, within two seconds; then single bytes ([`page_message`]). To the page: the messages of [`super::hub`],
//! and the state ten times a second. The page's beats come from animation frames of its main thread: a frozen or hidden page sends none.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use serde::Serialize;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::control::ClientId;
use super::hub::{MessageKind, json_message};
use super::jobs::JobState;
use super::line::DriveState;
use super::parts::Panel;
use super::stage::StopReason;

/// Time for the first message.
const TOKEN_TIMEOUT: Duration = Duration::from_secs(2);
/// Time for one message to a page that does not read.
const SEND_TIMEOUT: Duration = Duration::from_secs(5);
/// Interval of the state.
const STATE_INTERVAL: Duration = Duration::from_millis(100);

/// Messages of a page, one byte each.
mod page_message {
    /// A beat of the lease.
    pub const BEAT: u8 = 0x01;
    /// Take the control.
    pub const TAKE: u8 = 0x02;
    /// Give the control back: the button, a hidden tab, a page that closes.
    pub const LEAVE: u8 = 0x03;
    /// Stop, as on the wire; the number of the press may follow, eight bytes, little-endian.
    pub const STOP: u8 = 0x18;
}

/// What a page shows apart from rows.
#[derive(Serialize)]
struct PageState {
    client: ClientId,
    driver: Option<ClientId>,
    port: String,
    folder: String,
    drive: DriveState,
    job: JobState,
    lost_rows: u64,
    damaged_frames: u64,
}

fn state(panel: &Panel, client: ClientId) -> Bytes {
    let losses = panel.line.losses();
    let state = PageState {
        client,
        driver: panel.line.control().driver(Instant::now()),
        port: panel.line.name().to_owned(),
        folder: panel.session.folder().display().to_string(),
        drive: panel.hub.drive(),
        job: panel.hub.job(),
        lost_rows: losses.rows,
        damaged_frames: losses.damaged,
    };
    json_message(MessageKind::State, &state)
}

/// Serves one page until it leaves. Its control ends with it.
pub async fn serve(panel: Arc<Panel>, mut socket: WebSocket) {
    match timeout(TOKEN_TIMEOUT, socket.recv()).await {
        Ok(Some(Ok(Message::Binary(given)))) if panel.gate.token().is(&given) => {}
        _ => return,
    }
    let client = panel.next_client.fetch_add(1, Ordering::Relaxed);
    exchange(&panel, client, &mut socket).await;
    panel.leave(client, StopReason::Closed);
}

async fn exchange(panel: &Arc<Panel>, client: ClientId, socket: &mut WebSocket) {
    let (first, mut messages) = panel.hub.subscribe();
    let send = async |socket: &mut WebSocket, message: Bytes| {
        // Beats are read between the sends, so a page that reads slowly loses its lease before this time.
        matches!(timeout(SEND_TIMEOUT, socket.send(Message::Binary(message))).await, Ok(Ok(())))
    };
    if !send(socket, state(panel, client)).await {
        return;
    }
    for message in first {
        if !send(socket, message).await {
            return;
        }
    }
    let mut ticks = interval(STATE_INTERVAL);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let out = tokio::select! {
            biased;
            received = socket.recv() => match received {
                Some(Ok(Message::Binary(bytes))) => {
                    handle_message(panel, client, &bytes);
                    None
                }
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => None,
                _ => return,
            },
            _ = ticks.tick() => Some(state(panel, client)),
            message = messages.recv() => match message {
                Ok(message) => Some(message),
                Err(RecvError::Lagged(_)) => None,
                Err(RecvError::Closed) => return,
            },
        };
        if let Some(out) = out
            && !send(socket, out).await
        {
            return;
        }
    }
}

fn handle_message(panel: &Panel, client: ClientId, bytes: &[u8]) {
    match bytes.split_first() {
        Some((&page_message::STOP, press)) if press.len() == size_of::<u64>() => {
            panel.press_stop(press.try_into().ok().map(u64::from_le_bytes));
        }
        _ => bytes.iter().for_each(|byte| handle_byte(panel, client, *byte)),
    }
}

fn handle_byte(panel: &Panel, client: ClientId, given: u8) {
    let now = Instant::now();
    match given {
        page_message::BEAT => panel.line.control().beat(client, now),
        page_message::TAKE => {
            // A refusal shows in the state: another client is the driver.
            let _ = panel.line.control().take(client, now);
        }
        page_message::LEAVE => panel.leave(client, StopReason::Left),
        page_message::STOP => panel.press_stop(None),
        _ => {}
    }
}
