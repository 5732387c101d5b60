//! Pages, whole in one file: nothing is fetched from elsewhere.

use crate::replay::Replay;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

const STYLE: &str = include_str!("style.css");
const TABLES: &str = include_str!("tables.js");
const PLAYER: &str = include_str!("player.js");

/// The part of a page's body that the player draws in.
pub const PLAYER_SECTION: &str = include_str!("player.html");

/// Text within HTML.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A whole page of a title, a body of HTML, and scripts behind it.
pub fn page(title: &str, body: &str, scripts: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n\
         <link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n{body}</main>\n\
         <script>\n{TABLES}</script>\n{scripts}</body>\n</html>\n",
        escaped(title)
    )
}

/// The bytes of a replay ([`Replay::to_bytes`]) and the player, for a page that has [`PLAYER_SECTION`].
pub fn player_scripts(replay: &[u8]) -> String {
    let data = STANDARD.encode(replay);
    format!("<script id=\"replay-data\" type=\"text/plain\">{data}</script>\n<script>\n{PLAYER}</script>\n")
}

impl Replay {
    /// A page of its own: the title and the player.
    pub fn to_page(&self, title: &str) -> String {
        let body = format!("<h1>{}</h1>\n{PLAYER_SECTION}", escaped(title));
        page(title, &body, &player_scripts(&self.to_bytes()))
    }
}
