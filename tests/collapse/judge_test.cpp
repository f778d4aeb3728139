#include "coordinator/collapse/judge.h"
