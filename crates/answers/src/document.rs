//! The macro of JSON documents.

/// Makes a JSON document, or a part of a document: keys and values, in this order. Attributes are passed to serde; a part that may be absent is a flattened
/// `Option`.
#[macro_export]
macro_rules! document {
    ($($(#[$attribute:meta])* $key:ident: $value:expr),* $(,)?) => {{
        #[derive(serde::Serialize)]
        struct Document<$($key),*> {
            $($(#[$attribute])* $key: $key),*
        }
        Document { $($key: $value),* }
    }};
}
