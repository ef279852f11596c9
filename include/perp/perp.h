/* perp/perp.h: the whole surface of libperp. Each header can also be included alone; the second
 * library, libperp-mechanism, has its own: perp/mechanism.h. */
#ifndef PERP_PERP_H
#define PERP_PERP_H

#include <perp/base.h>
#include <perp/contact.h>
#include <perp/joint.h>
#include <perp/lcp.h>
#include <perp/matrix.h>
#include <perp/ncp.h>
#include <perp/statics.h>
#include <perp/world.h>

#endif
