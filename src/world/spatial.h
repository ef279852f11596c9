/* The name that the files of the world know the vectors of three by. */
#include "linalg/spatial.h"
