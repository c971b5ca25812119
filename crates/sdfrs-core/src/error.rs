//! What can be wrong with a scene or a scene file: one message each, saying what was asked, got and allowed.

/// A shape, formula or setting that cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{op}: {message}")]
pub struct SceneError {
    /// The operation that refused, e.g. `sphere`.
    pub op: String,
    pub message: String,
}

impl SceneError {
    pub fn new(op: impl Into<String>, message: impl Into<String>) -> Self {
        Self { op: op.into(), message: message.into() }
    }
}

/// A scene file that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {message}")]
pub struct FormatError {
    /// Where in the file, e.g. `nodes[17].radius`.
    pub path: String,
    pub message: String,
}

impl FormatError {
    pub fn new(path: impl Into<String>, message: impl Into<String>) -> Self {
        Self { path: path.into(), message: message.into() }
    }
}
