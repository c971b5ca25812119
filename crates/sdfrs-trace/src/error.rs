//! What can stop a trace.

use sdfrs_core::SceneError;

#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    /// Settings, rays or scene that cannot be traced.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The caller asked to stop.
    #[error("cancelled")]
    Cancelled,
}
