// {"mplicits": "VERSION", "target": "shadertoy", "name": "tiny \"/*\n</script>\\", "sha256": "e453f4b1682a", "levels": ["4x1", "8x0"]}
mat4 M(int a,int b,int c){
ivec3 v=ivec3(a,b,c),u=v>>30&3;
return mat4(v<<26>>26,u.x*16+u.y*4+u.z-32,v<<20>>26,v<<14>>26,v<<8>>26,v<<2>>26);
}
float network1(vec4 p){
p*=vec4(.0261,.0261,.0261,.00735);
vec4 a0=sin(mat4(35,-123,27,111,-59,80,59,81,-117,105,11,-127,97,-127,62,-88)*p);
vec4 b0=sin(.0393*(M(-1988325161,-567063965,971816519)*a0+vec4(-19,11,1,-10)));
float f=.00837*(dot(vec4(-4,114,127,-42),b0))+.14306;
return f;
}
float network2(vec4 p){
p*=vec4(.0235,.0235,.0235,.00696);
vec4 a0=sin(mat4(-51,-31,35,81,27,111,-118,-74,-46,-77,94,107,49,-86,127,-39)*p),
a1=sin(mat4(-125,-14,-127,-116,-46,84,-27,23,-99,-76,-86,-57,-113,37,123,-17)*p);
float f=.00675*(dot(vec4(117,0,-19,31),a0)+dot(vec4(127,115,-10,66),a1))+-.00515;
return f;
}
vec3 network_texture(vec4 p){
p*=vec4(.0255,.0255,.0255,.00758);
vec4 a0=sin(mat4(8,61,-101,122,75,55,60,-127,-22,113,112,95,127,121,-93,125)*p);
float r=.00752*(dot(vec4(127,105,-7,-87),a0))+.22875;
float g=.00817*(dot(vec4(91,127,-70,12),a0))+-.94327;
float b=.00886*(dot(vec4(-16,119,-127,64),a0))+.43844;
return vec3(r,g,b);
}
float field(vec4 p){
float f=network1(p);
if(abs(f)>1.)return f-.769;
f+=network2(p);
return f;
}
void mainImage(out vec4 o,vec2 q){
vec2 r=iResolution.xy,a=iMouse.x>0.?6.28*iMouse.xy/r-vec2(3.14,2.5):vec2(.52+.3*iTime,.35),s=sin(a),c=cos(a);
mat3 m=mat3(c.x,0,-s.x,-s.y*s.x,c.y,-s.y*c.x,c.y*s.x,s.y,c.y*c.x);
vec3 v=normalize(m*vec3((2.*q-r)/r.y,-3.17)),l=m*vec3(-.43,.6,.68),n=vec3(0),e;
float b=3.52*dot(m[2],v),h=sqrt(max(b*b-11.35,0.)),t=-b-h,f;
int k=-1;
for(int i=min(iFrame,0);i<200&&k<4&&t<h-b;i++){
e=k<0?vec3(0):vec3(k+3>>1&1,k>>1&1,k&1)-.5;
f=field(vec4(3.52*m[2]+t*v+.002*e,1));
if(k>=0){n+=f*e;k++;}
else if(abs(f)<.06*t/r.y)k=0;
else t+=.8*f;
}
o=vec4(mix(vec3(.13,.14,.17),vec3(.33,.36,.41),q.y/r.y),1);
if(k>3){
n=normalize(n);
o.rgb=pow(clamp(network_texture(vec4(3.52*m[2]+t*v,1)),0.,1.),vec3(2.2))*(mix(vec3(.16,.13,.12),vec3(.34,.38,.46),.5+.5*dot(n,m[1]))
+max(dot(n,l),0.)*vec3(1.05,1,.95))+.14*pow(max(dot(reflect(v,n),l),0.),48.);
o=pow(o,vec4(.4545));
}
}
