//! The page, embedded: its source is its asset.

/// A file of the page.
pub struct Asset {
    /// Path in the address.
    pub path: &'static str,
    /// Content type.
    pub kind: &'static str,
    /// Contents.
    pub text: &'static str,
}

macro_rules! assets {
    ($($path:literal $kind:literal $file:literal;)*) => {
        &[$(Asset { path: $path, kind: $kind, text: include_str!(concat!("../page/", $file)) }),*]
    };
}

/// All files.
pub const ASSETS: &[Asset] = assets! {
    "/" "text/html; charset=utf-8" "index.html";
    "/style.css" "text/css; charset=utf-8" "style.css";
    "/icon.svg" "image/svg+xml" "icon.svg";
    "/main.js" "text/javascript; charset=utf-8" "main.js";
    "/connection.js" "text/javascript; charset=utf-8" "connection.js";
    "/live.js" "text/javascript; charset=utf-8" "live.js";
    "/drive.js" "text/javascript; charset=utf-8" "drive.js";
    "/identify.js" "text/javascript; charset=utf-8" "identify.js";
    "/explanation.js" "text/javascript; charset=utf-8" "explanation.js";
    "/signature.js" "text/javascript; charset=utf-8" "signature.js";
    "/residuals.js" "text/javascript; charset=utf-8" "residuals.js";
    "/plot-group.js" "text/javascript; charset=utf-8" "plot-group.js";
    "/import.js" "text/javascript; charset=utf-8" "import.js";
    "/compensate.js" "text/javascript; charset=utf-8" "compensate.js";
    "/measure.js" "text/javascript; charset=utf-8" "measure.js";
    "/laboratory.js" "text/javascript; charset=utf-8" "laboratory.js";
    "/plot.js" "text/javascript; charset=utf-8" "plot.js";
    "/fields.js" "text/javascript; charset=utf-8" "fields.js";
    "/dom.js" "text/javascript; charset=utf-8" "dom.js";
    "/text.js" "text/javascript; charset=utf-8" "text.js";
    "/vendor/uPlot.esm.js" "text/javascript; charset=utf-8" "vendor/uPlot.esm.js";
    "/vendor/uPlot.min.css" "text/css; charset=utf-8" "vendor/uPlot.min.css";
    "/vendor/uPlot-LICENSE" "text/plain; charset=utf-8" "vendor/uPlot-LICENSE";
};
