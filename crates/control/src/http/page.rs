//! The pages, compiled into the program: single documents, with style and script allowed by their hashes.

use std::sync::LazyLock;

use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse as _, Response};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

/// Joins files of the folder `page`, as a constant text.
macro_rules! files {
    ($($name:literal),+) => {
        concat!($(include_str!(concat!("../../page/", $name))),+)
    };
}

/// Scripts of every page on which a person moves a hand and sees the scene.
macro_rules! hand_scripts {
    () => {
        files!(
            "turn.js",
            "play/socket.js",
            "play/motion.js",
            "play/rooms.js",
            "play/packets.js",
            "play/task.js",
            "play/draw.js",
            "play/hand.js",
            "play/keyboard.js",
            "play/gamepad.js"
        )
    };
}

const STYLE: &str = files!("style.css");
const SCRIPT: &str = files!(
    "server.js",
    "events.js",
    "words.js",
    "history.js",
    "plot.js",
    "links.js",
    "scales.js",
    "editor.js",
    "copies.js",
    "turn.js",
    "depth.js",
    "facts.js",
    "main.js"
);

static PAGE: LazyLock<Document> = LazyLock::new(|| Document::new(files!("page.html"), STYLE, SCRIPT));
static DOOR: LazyLock<Document> = LazyLock::new(|| Document::new(files!("door.html"), STYLE, files!("door.js")));

const PLAY_STYLE: &str = files!("style.css", "play/style.css");
const PLAY_SCRIPT: &str = concat!(
    files!("server.js", "words.js", "scales.js"),
    hand_scripts!(),
    files!("play/controls.js", "play/steps.js", "play/compare.js", "play/main.js")
);

static PLAY: LazyLock<Document> = LazyLock::new(|| Document::new(files!("play/page.html"), PLAY_STYLE, PLAY_SCRIPT));

const STUDY_STYLE: &str = files!("style.css", "play/style.css", "study/style.css");
const PERSON_SCRIPT: &str =
    concat!(files!("server.js", "words.js"), hand_scripts!(), files!("study/words.js", "study/questions.js", "study/person.js"));
const EXPERIMENTER_SCRIPT: &str = files!("server.js", "words.js", "study/experimenter.js");

static PERSON: LazyLock<Document> = LazyLock::new(|| Document::new(files!("study/person.html"), STUDY_STYLE, PERSON_SCRIPT));
static EXPERIMENTER: LazyLock<Document> = LazyLock::new(|| Document::new(files!("study/experimenter.html"), STUDY_STYLE, EXPERIMENTER_SCRIPT));

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
