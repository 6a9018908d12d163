#include "core.h"
EXPORTED double core_unit(void) { return UNIT; }
