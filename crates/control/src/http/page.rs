//! The pages, compiled into the program: single documents, with style and script allowed by their hashes.

use std::sync::LazyLock;

use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

const STYLE: &str = include_str!("../../page/style.css");
const SCRIPT: &str = concat!(
    include_str!("../../page/server.js"),
    include_str!("../../page/events.js"),
    include_str!("../../page/words.js"),
    include_str!("../../page/history.js"),
    include_str!("../../page/plot.js"),
    include_str!("../../page/links.js"),
    include_str!("../../page/scales.js"),
    include_str!("../../page/editor.js"),
    include_str!("../../page/copies.js"),
    include_str!("../../page/turn.js"),
    include_str!("../../page/depth.js"),
    include_str!("../../page/facts.js"),
    include_str!("../../page/main.js"),
);

static PAGE: LazyLock<Document> = LazyLock::new(|| Document::new(include_str!("../../page/page.html"), STYLE, SCRIPT));
static DOOR: LazyLock<Document> = LazyLock::new(|| Document::new(include_str!("../../page/door.html"), STYLE, include_str!("../../page/door.js")));

const PLAY_STYLE: &str = concat!(include_str!("../../page/style.css"), include_str!("../../page/play/style.css"));
const PLAY_SCRIPT: &str = concat!(
    include_str!("../../page/server.js"),
    include_str!("../../page/words.js"),
    include_str!("../../page/scales.js"),
    include_str!("../../page/turn.js"),
    include_str!("../../page/play/socket.js"),
    include_str!("../../page/play/motion.js"),
    include_str!("../../page/play/rooms.js"),
    include_str!("../../page/play/packets.js"),
    include_str!("../../page/play/task.js"),
    include_str!("../../page/play/draw.js"),
    include_str!("../../page/play/hand.js"),
    include_str!("../../page/play/keyboard.js"),
    include_str!("../../page/play/gamepad.js"),
    include_str!("../../page/play/controls.js"),
    include_str!("../../page/play/steps.js"),
    include_str!("../../page/play/compare.js"),
    include_str!("../../page/play/main.js"),
);

static PLAY: LazyLock<Document> = LazyLock::new(|| Document::new(include_str!("../../page/play/page.html"), PLAY_STYLE, PLAY_SCRIPT));

const STUDY_STYLE: &str =
    concat!(include_str!("../../page/style.css"), include_str!("../../page/play/style.css"), include_str!("../../page/study/style.css"));
const PERSON_SCRIPT: &str = concat!(
    include_str!("../../page/server.js"),
    include_str!("../../page/words.js"),
    include_str!("../../page/turn.js"),
    include_str!("../../page/play/socket.js"),
    include_str!("../../page/play/motion.js"),
    include_str!("../../page/play/rooms.js"),
    include_str!("../../page/play/packets.js"),
    include_str!("../../page/play/task.js"),
    include_str!("../../page/play/draw.js"),
    include_str!("../../page/play/hand.js"),
    include_str!("../../page/play/keyboard.js"),
    include_str!("../../page/play/gamepad.js"),
    include_str!("../../page/study/words.js"),
    include_str!("../../page/study/questions.js"),
    include_str!("../../page/study/person.js"),
);
const EXPERIMENTER_SCRIPT: &str =
    concat!(include_str!("../../page/server.js"), include_str!("../../page/words.js"), include_str!("../../page/study/experimenter.js"));

static PERSON: LazyLock<Document> = LazyLock::new(|| Document::new(include_str!("../../page/study/person.html"), STUDY_STYLE, PERSON_SCRIPT));
static EXPERIMENTER: LazyLock<Document> =
    LazyLock::new(|| Document::new(include_str!("../../page/study/experimenter.html"), STUDY_STYLE, EXPERIMENTER_SCRIPT));

/// A page with its content security policy.
struct Document {
    html: String,
    policy: HeaderValue,
}

impl Document {
    /// Inserts style and script in the places marked `{{style}}` and `{{script}}`.
    fn new(html: &str, style: &str, script: &str) -> Self {
        // The function keeps all names of the script local.
        let script = format!("(() => {{\n'use strict';\n{script}\n}})();");
        let hash = |text: &str| STANDARD.encode(Sha256::digest(text.as_bytes()));
        // Only this style and this script may run: names from a scene that contain HTML cannot add a script.
        let policy = format!(
            "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; connect-src 'self'; img-src data:; form-action 'self'; \
             base-uri 'none'; frame-ancestors 'none'",
            hash(&script),
            hash(style)
        );
        Self {
            // The script comes last, so that no text of the script is taken for a place.
            html: html.replace("{{style}}", style).replace("{{script}}", &script),
            policy: HeaderValue::try_from(policy).expect("base64 and ASCII words"),
        }
    }

    fn answer(&'static self, status: StatusCode) -> Response {
        let headers: [(HeaderName, HeaderValue); 2] =
            [(header::CONTENT_TYPE, HeaderValue::from_static("text/html; charset=utf-8")), (header::CONTENT_SECURITY_POLICY, self.policy.clone())];
        (status, headers, self.html.as_str()).into_response()
    }
}

/// Answers with the page of counters and links.
pub(super) async fn page() -> Response {
    PAGE.answer(StatusCode::OK)
}

/// Answers with the page of a run in which people take part.
pub(super) async fn play() -> Response {
    PLAY.answer(StatusCode::OK)
}

/// Answers with the page of a person in a study.
pub(super) async fn person() -> Response {
    PERSON.answer(StatusCode::OK)
}

/// Answers with the page of a study's experimenter.
pub(super) async fn experimenter() -> Response {
    EXPERIMENTER.answer(StatusCode::OK)
}

/// Answers a browser without a token: the document reads the token from the tab's storage, or asks for the token.
pub(super) fn door() -> Response {
    DOOR.answer(StatusCode::UNAUTHORIZED)
}
