pub struct Linked; pub fn link(){}
