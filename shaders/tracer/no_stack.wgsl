// Tracers without a stack. Twin: none, see stack.wgsl.

fn select_stack(ray: u32) {}
