//! The server: connections, the gate before all routes, headers of every response.

use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Request, State};
use axum::http::header::CONTENT_TYPE;
use axum::http::{HeaderValue, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::time::timeout;

use super::api;
use super::assets::ASSETS;
use super::parts::Panel;
use super::security::{Gate, RESPONSE_HEADERS, Token};
use super::socket;

/// Pages at a time.
const MAX_CLIENTS: usize = 16;
/// Connections at a time: each page has a WebSocket and up to six requests.
const MAX_CONNECTIONS: usize = 7 * MAX_CLIENTS;
/// Longest message of a page, bytes.
const MAX_MESSAGE: usize = 64 << 10;
/// Time for the head of a request.
const HEAD_TIMEOUT: Duration = Duration::from_secs(5);
/// Time for a request with its body and its answer.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(30);

/// The listening server: where it is, before it serves.
pub struct Server {
    listener: std::net::TcpListener,
    gate: Gate,
}

impl Server {
    /// Binds a port of the loopback interface; 0: a free one.
    ///
    /// # Errors
    /// The port is in use, or there is no random generator.
    pub fn bind(port: u16) -> io::Result<Self> {
        let listener = std::net::TcpListener::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, port)))?;
        listener.set_nonblocking(true)?;
        let gate = Gate::new(listener.local_addr()?.port(), Token::random()?);
        Ok(Server { listener, gate })
    }

    /// The checks of this server.
    pub fn gate(&self) -> Gate {
        self.gate.clone()
    }

    /// Address of the page, with the token in its fragment.
    ///
    /// # Errors
    /// The socket has no address.
    pub fn address(&self) -> io::Result<String> {
        Ok(format!("http://127.0.0.1:{}/#{}", self.listener.local_addr()?.port(), self.gate.token().reveal()))
    }

    /// Serves until `ends` is true; asked ten times a second.
    ///
    /// # Errors
    /// The runtime cannot be started.
    pub fn serve(self, panel: Arc<Panel>, ends: impl Fn() -> bool) -> io::Result<()> {
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        let served = runtime.block_on(async {
            let listener = TcpListener::from_std(self.listener)?;
            let accepting = tokio::spawn(accept(listener, router(panel)));
            while !ends() {
                tokio::time::sleep(Duration::from_millis(100)).await;
            }
            accepting.abort();
            Ok(())
        });
        // Computations that still run are threads of their own and end with the process.
        runtime.shutdown_timeout(Duration::from_millis(200));
        served
    }
}

async fn accept(listener: TcpListener, router: Router) {
    let connections = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let Ok(permit) = connections.clone().acquire_owned().await else { return };
        let Ok((stream, _)) = listener.accept().await else {
            // No file handles left: try again when connections have ended.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let _ = stream.set_nodelay(true);
        let service = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let mut http = http1::Builder::new();
            http.timer(TokioTimer::new()).header_read_timeout(HEAD_TIMEOUT).max_buf_size(MAX_MESSAGE);
            // A client that breaks off is no event.
            let _ = http.serve_connection(TokioIo::new(stream), service).with_upgrades().await;
            drop(permit);
        });
    }
}

fn router(panel: Arc<Panel>) -> Router {
    let mut router = Router::new().route("/socket", get(upgrade));
    for asset in ASSETS {
        router = router.route(asset.path, get(move || async move { ([(CONTENT_TYPE, asset.kind)], asset.text) }));
    }
    router.nest("/api", api::routes(panel.clone())).layer(from_fn_with_state(panel.clone(), guard)).with_state(panel)
}

/// Before every route: the gate. After it: the headers.
async fn guard(State(panel): State<Arc<Panel>>, request: Request, next: Next) -> Response {
    let mut response = match panel.gate.check(request.method(), request.uri(), request.headers()) {
        Err(status) => status.into_response(),
        Ok(()) => timeout(REQUEST_TIMEOUT, next.run(request)).await.unwrap_or_else(|_| StatusCode::REQUEST_TIMEOUT.into_response()),
    };
    for (name, value) in RESPONSE_HEADERS {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// One of the pages that may be open; given back when it is dropped.
struct ClientSlot(Arc<Panel>);

impl ClientSlot {
    fn take(panel: &Arc<Panel>) -> Option<Self> {
        let taken = panel.clients.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |n| (n < MAX_CLIENTS).then_some(n + 1));
        taken.is_ok().then(|| ClientSlot(panel.clone()))
    }
}

impl Drop for ClientSlot {
    fn drop(&mut self) {
        self.0.clients.fetch_sub(1, Ordering::SeqCst);
    }
}

async fn upgrade(State(panel): State<Arc<Panel>>, upgrade: WebSocketUpgrade) -> Response {
    let Some(slot) = ClientSlot::take(&panel) else {
        return (StatusCode::SERVICE_UNAVAILABLE, "16 pages are open: close one").into_response();
    };
    upgrade.max_message_size(MAX_MESSAGE).max_frame_size(MAX_MESSAGE).on_upgrade(move |socket| async move {
        socket::serve(slot.0.clone(), socket).await;
        drop(slot);
    })
}
