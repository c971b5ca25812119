//! What is wrong with a mesh or with what was asked of it: asked, got, allowed.

/// One error for the whole room; a reader puts the file's name in front.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// The element (a vertex, a face, a line of a file, an argument) and what is wrong with it.
    #[error("{element}: {message}")]
    Bad { element: String, message: String },
    /// Asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl MeshError {
    pub fn bad(element: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Bad { element: element.into(), message: message.into() }
    }
}
