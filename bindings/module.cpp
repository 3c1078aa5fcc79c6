#include "arrays.hpp"

PYBIND11_MODULE(_core, module) {
  module.doc() = "The engine behind surefix. Private: use `import surefix`.";
  module.attr("__version__") = SUREFIX_VERSION;
  surefix::bindings::bind_core(module);
  surefix::bindings::bind_desync(module);
  surefix::bindings::bind_drift(module);
  surefix::bindings::bind_raim(module);
  surefix::bindings::bind_robust(module);
  surefix::bindings::bind_switching(module);
}
