/* perp/perp.h: the whole public surface. Each header can also be included alone. */
#ifndef PERP_PERP_H
#define PERP_PERP_H

#include <perp/base.h>
#include <perp/bristle.h>
#include <perp/contact.h>
#include <perp/friction.h>
#include <perp/joint.h>
#include <perp/lcp.h>
#include <perp/matrix.h>
#include <perp/mechanism.h>
#include <perp/ncp.h>
#include <perp/statics.h>
#include <perp/world.h>

#endif
