//! Admission of requests by host and token, and security headers of all answers.

use std::net::{Ipv4Addr, Ipv6Addr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Redirect, Response};

use super::slots::Slot;
use super::{App, People, Refusal, page};
use crate::Role;

/// Headers added to every answer without a header of the same name.
const HEADERS: [(HeaderName, &str); 7] = [
    (header::CONTENT_SECURITY_POLICY, "default-src 'none'; frame-ancestors 'none'"),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

/// Passes a request to its route, or refuses the request.
pub(super) async fn guard(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let mut request = request;
    let slot = request.extensions().get::<Arc<Slot>>().cloned();
    // The host is checked before the token: a page of another site must not learn whether a token is right.
    let known = check_host(&app, request.uri(), request.headers());
    let shown = known.and_then(|()| check_token(&app, request.uri(), request.headers()));
    let admitted = shown.and_then(|shown| take_slot(slot.as_deref(), shown));
    // Only guests wait for their turn, so guests cannot delay the host.
    if matches!(admitted, Ok(Visitor::Guest(_))) {
        app.pace.turn().await;
    }
    let mut answer = match admitted.and_then(|visitor| may(&app, visitor, &request)) {
        // Tried only without a token, since every try uses the ticket up.
        Err(refusal) if refusal.status == StatusCode::UNAUTHORIZED && has_ticket(&app, request.uri(), request.method()) => {
            Redirect::to(&format!("/?token={}", app.token.secret())).into_response()
        }
        Ok(visitor) => {
            request.extensions_mut().insert(visitor.role());
            request.extensions_mut().insert(visitor);
            next.run(request).await
        }
        // A browser gets a page with a field for the token instead of JSON.
        Err(refusal)
            if refusal.status == StatusCode::UNAUTHORIZED
                && ["/", "/join", "/details", "/open"].contains(&request.uri().path())
                && accepts_html(request.headers()) =>
        {
            page::door()
        }
        Err(refusal) => refusal.into_response(),
    };
    if answer.status() == StatusCode::UNAUTHORIZED {
        answer.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    }
    // Connections without a token have few slots. Closing after each answer frees the slot.
    if slot.is_some_and(|slot| slot.is_strange()) {
        answer.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    for (name, value) in HEADERS {
        answer.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    answer
}

/// Counts the connection among the connections of `role`, or refuses if all slots of the role are taken.
fn take_slot(slot: Option<&Slot>, visitor: Visitor) -> Result<Visitor, Refusal> {
    if slot.is_some_and(|slot| !slot.show(visitor.role())) {
        return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "too many connections are open with this token: close some, or try again later"));
    }
    Ok(visitor)
}

/// Refuses all requests of guests except GET. A WebSocket for a hand begins with GET too. In a study, people also send consent and answers.
fn may(app: &App, visitor: Visitor, request: &Request) -> Result<Visitor, Refusal> {
    let is_answer = matches!(app.people, People::Study(_)) && request.uri().path() == "/api/person";
    if visitor.role() == Role::Guest && request.method() != Method::GET && !is_answer {
        return Err(Refusal::new(StatusCode::FORBIDDEN, "only the person who started the run may change it: this token is that of a guest"));
    }
    Ok(visitor)
}

/// Layer that refuses guests.
pub(super) async fn host_only(axum::Extension(role): axum::Extension<Role>, request: Request, next: Next) -> Response {
    if role == Role::Guest {
        return Refusal::new(StatusCode::FORBIDDEN, "only the experimenter may see this: this token is that of a participant").into_response();
    }
    next.run(request).await
}

/// Refuses requests for unknown hosts, in the `Host` header or in the request line.
fn check_host(app: &App, uri: &Uri, headers: &HeaderMap) -> Result<(), Refusal> {
    let mut hosts = headers.get_all(header::HOST).iter();
    let (Some(host), None) = (hosts.next(), hosts.next()) else {
        return Err(Refusal::new(StatusCode::FORBIDDEN, "expected exactly one Host header"));
    };
    let known = |authority: &str| is_known(authority, &app.hosts);
    // The request line may name the host too, and must then name a known host as well.
    if !host.to_str().is_ok_and(known) || !uri.authority().is_none_or(|authority| known(authority.as_str())) {
        return Err(Refusal::new(
            StatusCode::FORBIDDEN,
            format!("the host {:?} is not known here: ask for localhost, for an address, or for a name that the server was started with", host),
        ));
    }
    Ok(())
}

/// Returns whether the request comes with the valid ticket. The ticket is invalid afterwards.
fn has_ticket(app: &App, uri: &Uri, method: &Method) -> bool {
    let offered = || uri.query().unwrap_or_default().split('&').find_map(|part| part.strip_prefix("ticket="));
    uri.path() == "/open" && method == Method::GET && offered().is_some_and(|offered| app.ticket.redeem(offered.as_bytes()))
}

/// The person behind a request, by the shown token.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Visitor {
    Host,
    /// Guest with the token of this number.
    Guest(usize),
}

impl Visitor {
    const fn role(self) -> Role {
        match self {
            Self::Host => Role::Host,
            Self::Guest(_) => Role::Guest,
        }
    }
}

/// Returns the owner of the token, shown in the header `Authorization` or in the query.
pub(super) fn check_token(app: &App, uri: &Uri, headers: &HeaderMap) -> Result<Visitor, Refusal> {
    let in_header = headers.get_all(header::AUTHORIZATION).iter().filter_map(|value| bearer(value.as_bytes()));
    let in_query = uri.query().unwrap_or_default().split('&').filter_map(|part| part.strip_prefix("token=")).map(str::as_bytes);
    let owner = |offered: &[u8]| if app.token.is(offered) { Some(Visitor::Host) } else { app.guests.find(offered).map(Visitor::Guest) };
    in_header.chain(in_query).find_map(owner).ok_or_else(|| {
        Refusal::new(
            StatusCode::UNAUTHORIZED,
            "no token, or a wrong one: show it as \"Authorization: Bearer TOKEN\" or as ?token=TOKEN; it was printed when the server started",
        )
    })
}

/// Returns whether the server answers for a host, given with or without a port.
///
/// An attacker can point a name of his own at this machine and let a page of that name send requests. A browser puts the attacker's name into `Host`. So
/// only addresses, `localhost` and configured names are accepted.
fn is_known(authority: &str, names: &[String]) -> bool {
    let (host, port) = match authority.strip_prefix('[') {
        Some(inside) => inside.split_once(']').unwrap_or_default(),
        None => authority.split_at(authority.find(':').unwrap_or(authority.len())),
    };
    let is_port = port.is_empty() || port.strip_prefix(':').is_some_and(|digits| digits.parse::<u16>().is_ok());
    let is_host = if authority.starts_with('[') {
        host.parse::<Ipv6Addr>().is_ok()
    } else {
        host.parse::<Ipv4Addr>().is_ok() || host.eq_ignore_ascii_case("localhost") || names.iter().any(|name| name.eq_ignore_ascii_case(host))
    };
    is_port && is_host
}

/// Returns the token of a header `Authorization: Bearer TOKEN`.
fn bearer(value: &[u8]) -> Option<&[u8]> {
    let (scheme, token) = value.split_at_checked(7)?;
    scheme.eq_ignore_ascii_case(b"bearer ").then(|| token.trim_ascii())
}

fn accepts_html(headers: &HeaderMap) -> bool {
    headers.get(header::ACCEPT).and_then(|accept| accept.to_str().ok()).is_some_and(|accept| accept.contains("text/html"))
}
