//! How a document is made.

/// A JSON document, or a part of one: keys and values, in this order. Attributes are those of serde; a part that may be absent is a flattened `Option`.
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
