// {"mplicits": "VERSION", "target": "shadertoy", "name": "tiny \"/*\n</script>\\", "sha256": "e453f4b1682a", "levels": ["4x1", "8x0"]}
// "tiny \"/*\n</script>\\"
// as a neural signed distance function, made with mplicits. Drag to orbit; edit the settings below.
#define VIEW vec2(30., 20.) // initial azimuth and elevation, degrees
#define SPEED .3 // speed of the turntable, radians per second
#define LIGHT vec3(-.5, .7, .8) // direction to the light: right, up, back
#define COLOR(c) c // color of the surface, sRGB; c: the model's
#define BOTTOM vec3(.13, .14, .17) // background, sRGB
#define TOP vec3(.33, .36, .41)
#define LEVEL 2 // finest level, from 1
#define STEPS 200 // most evaluations of the field on a ray
#define AA 1 // 2: 2 x 2 samples per pixel
int k=-1,J;
#define D(v,k)vec4(v/(k)%ivec4(B)-B/2)
#define L(b,s){const int B=b;const float S=s;
#define M(v)mat4(D(v,1),D(v,B),D(v,B*B),D(v,B*B*B))
#define N(v,w)mat4(D(v,1),D(v,B),D(w,1),D(w,B))
#define E(i,a,b,c,d)dot(D(ivec4(a,b,c,d),1),x[i])+dot(D(ivec4(a,b,c,d),B),x[i+1])
#define R0(j,a,b,c,d,e,f,g,h)y[j]=sin(S*(N(ivec4(a,b,c,d),ivec4(e,f,g,h))*x[0]));
#define R1(j,a,b,c,d,e,f,g,h)y[j]=sin(S*(vec4(a,b,c,d)+M(ivec4(e,f,g,h))*x[0]));
float network1(vec4 p){
vec4[1] x,y;
x[0]=p*vec4(.0261,.0261,.0261,.00735);
L(255,1.)
R0(0,17502,52789,47584,53278,57130,232,48333,9945)
x=y;}
L(63,.0393)
R1(0,-19,11,1,-10,6578829,10169084,15500495,6174358)
x=y;}
const int B=255;
float f=.00837*(dot(vec4(-4,114,127,-42),x[0]))+(.14306);
return f;
}
float network2(vec4 p){
vec4[2] x,y;
x[0]=p*vec4(.0235,.0235,.0235,.00696);
L(255,1.)
R0(0,39346,60786,2457,13723,44961,10505,64991,22674)
R0(1,20657,53918,25500,38261,3598,41871,63791,28120)
x=y;}
const int B=255;
float f=.00675*(E(0,65014,61837,29943,49373))+(-.00515);
return f;
}
vec3 network_texture(vec4 p){
vec4[1] x,y;
x[0]=p*vec4(.0255,.0255,.0255,.00758);
L(255,1.)
R0(0,51645,46598,47711,249,64875,63480,8909,64482)
x=y;}
const int B=255;
float r=.00752*(dot(vec4(127,105,-7,-87),x[0]))+(.22875);
float g=.00817*(dot(vec4(91,127,-70,12),x[0]))+(-.94327);
float b=.00886*(dot(vec4(-16,119,-127,64),x[0]))+(.43844);
return vec3(r,g,b);
}
float field(vec4 p){
float f=network1(p);
#if LEVEL>=2
if(k<0)J=abs(f)>1.?1:9;
if(J<2)return f-.769;
f+=network2(p);
#endif
return f;
}
void mainImage(out vec4 o,vec2 q){
vec2 r=iResolution.xy,u;
float z=min(r.x,r.y);
vec2 a=radians(VIEW)+vec2(SPEED*iTime,0)-3.14*(iMouse.xy-abs(iMouse.zw))/z,s,c;
a.y=clamp(a.y,-1.4,1.4);
s=sin(a);
c=cos(a);
mat3 m=mat3(c.x,0,-s.x,-s.y*s.x,c.y,-s.y*c.x,c.y*s.x,s.y,c.y*c.x);
vec3 l=m*normalize(LIGHT);
o=vec4(0);
for(int j=min(iFrame,0);j<AA*AA;j++){
u=q+(vec2(j % AA,j/AA)+.5)/float(AA)-.5;
vec3 v=normalize(m*vec3((2.*u-r)/z,-3.17)),n=vec3(0),e,w=pow(mix(BOTTOM,TOP,u.y/r.y),vec3(2.2));
float t=0.,h,p=0.,d=1.,s,f,g,b;
b=-3.52*dot(m[2],v);
h=sqrt(max(b*b-11.35,0.));
t=b-h;
h+=b;
k=-1;
for(int i=min(iFrame,0);i<STEPS&&k<4&&t<h;i++){
e=k<0?vec3(0):vec3(k+3>>1&1,k>>1&1,k&1)-.5;
f=field(vec4(3.52*m[2]+t*v+.002*e,1));
if(k>=0){n+=f*e;k++;}
else if(abs(f)<.06*t/z)k=0;
else{
f*=.8;
g=min(.63*t/z,.005);
s=p>0.?(p-f)/d:1.;
b=f;
if(f<0.)d+=b/=s;
else if(p>0.&&d>p+f+g){b=p-d;p=0.;}
else{
if(f<3.*g)b=max(f,min(1.8*f/(1.+max(s,0.))+.9*g,f/max(s,.5)));
p=f;
d=b;
}
t+=b;
}
}
if(k>3){
n=normalize(n);
e=reflect(v,n);
g=dot(n,l);
w=pow(clamp(COLOR(network_texture(vec4(3.52*m[2]+t*v,1))),0.,1.),vec3(2.2));
w=w*(mix(vec3(.16,.13,.12),vec3(.34,.38,.46),.5+.5*dot(n,m[1]))+max(g,0.)*vec3(1.05,1,.95))
+.14*pow(max(dot(e,l),0.),48.);
e=max(w-.6,0.);
w+=e/(1.+2.*e)-e;
}
o+=vec4(w,1);
}
o=pow(o/o.a,vec4(.4545));
}
